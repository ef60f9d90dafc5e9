/** Loads designs of jobs and published designs. */

import { get } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import { readableJob } from '../../api/readable'
import type { Controller, Evaluation, Job, JobSpec, Scenario } from '../../api/types'
import { placeWord } from '../../format/place'
import type { Design } from '../../format/value'
import type { DesignSource } from './design-source'

/** A design with everything needed to simulate it. */
export interface ResolvedDesign {
  readonly source: DesignSource
  /** For headings and legends. */
  readonly label: string
  readonly robot: JobSpec['robot']
  readonly controller: Controller
  readonly design: Design
  /** Perturbations of the model, by name. */
  readonly world?: Readonly<Record<string, number>>
  /** Job of the design. */
  readonly job?: Job
  /** Scenarios of its job; empty without a job. */
  readonly scenarios: readonly Scenario[]
}

/** Load the design of a source. like: controller to prefer if the source names none. */
export async function resolveDesign(
  source: DesignSource,
  signal: AbortSignal,
  like?: string,
): Promise<ResolvedDesign> {
  const { items: controllers } = await get('/v1/controllers', { signal })
  if (source.kind === 'best' || source.kind === 'particle') {
    return ofJob(source, controllers, signal)
  }
  if (source.kind === 'published') return published(source, controllers, like)
  const controller = named(controllers, source.controller)
  return {
    source,
    label: 'Custom design',
    robot: 'szabadka2-reconstructed',
    controller,
    design: source.design,
    scenarios: [],
  }
}

async function ofJob(
  source: Extract<DesignSource, { job: string }>,
  controllers: readonly Controller[],
  signal: AbortSignal,
): Promise<ResolvedDesign> {
  const job = await readableJob(source.job, signal)
  const { spec } = job
  if (spec.kind !== 'tuning' && spec.kind !== 'certificate') {
    throw new ApiProblem(
      422,
      'this job fits parameters of the simulation; its designs are not controllers. See the' +
        ' job’s page instead',
    )
  }
  const evaluation = await evaluationOf(source, job, signal)
  const name = spec.name || job.id
  return {
    source,
    job,
    label: source.kind === 'best' ? `Best of ${name}` : `${name}, design ${placeWord(evaluation)}`,
    // Evaluations of a certificate are worlds, all with the same design.
    ...(spec.kind === 'certificate'
      ? { design: spec.design, world: worldOf(evaluation) }
      : { design: evaluation.design }),
    robot: spec.robot,
    controller: named(controllers, spec.controller),
    scenarios: spec.scenarios.filter((entry) => typeof entry !== 'string'),
  }
}

/** Perturbations of a certificate's world; throws for worlds simulated by another engine. */
function worldOf(evaluation: Evaluation): Readonly<Record<string, number>> {
  const { engine = 'gaitswarm', ...world } = evaluation.design
  if (engine === 'gaitswarm') return world as Readonly<Record<string, number>>
  throw new ApiProblem(
    422,
    `this walk was simulated by ${engine}, which does not record it; the first design of the job is` +
      ' the same walk in gaitswarm',
  )
}

async function evaluationOf(
  source: Extract<DesignSource, { job: string }>,
  job: Job,
  signal: AbortSignal,
): Promise<Evaluation> {
  if (source.kind === 'best') {
    if (job.best) return job.best
    throw new ApiProblem(404, 'no design of this job has succeeded in every scenario yet')
  }
  const path = { job_id: source.job, iteration: source.iteration }
  const { items: evaluations } = await get('/v1/jobs/{job_id}/iterations/{iteration}/evaluations', {
    path,
    signal,
  })
  const match = evaluations.find((evaluation) => evaluation.particle === source.particle)
  if (match) return match
  throw new ApiProblem(
    404,
    `iteration ${source.iteration} has no design ${source.particle}; valid are 0 to ${evaluations.length - 1}`,
  )
}

function published(
  source: Extract<DesignSource, { kind: 'published' }>,
  controllers: readonly Controller[],
  like?: string,
): ResolvedDesign {
  const preferred = source.controller ?? like
  const ordered = [...controllers].sort(
    (a, b) => Number(b.name === preferred) - Number(a.name === preferred),
  )
  const searched = source.controller ? [named(controllers, source.controller)] : ordered
  for (const controller of searched) {
    const study = source.study || Object.keys(controller.published)[0]
    const design = study === undefined ? undefined : controller.published[study]
    if (!design) continue
    const exact: DesignSource = { kind: 'published', controller: controller.name, study }
    return {
      source: exact,
      label: `Published ${study}, ${controller.name}`,
      robot: 'szabadka2-reconstructed',
      controller,
      design,
      scenarios: [],
    }
  }
  const available = controllers.flatMap((c) =>
    Object.keys(c.published).map((study) => `${study} of ${c.name}`),
  )
  const of = source.controller ? ` of ${source.controller}` : ''
  throw new ApiProblem(
    404,
    `there is no published design ${source.study}${of}; available: ${available.join(', ')}`,
  )
}

function named(controllers: readonly Controller[], name: string): Controller {
  const match = controllers.find((controller) => controller.name === name)
  if (match) return match
  const available = controllers.map((controller) => controller.name).join(', ')
  throw new ApiProblem(404, `no controller ${name}; available: ${available}`)
}
