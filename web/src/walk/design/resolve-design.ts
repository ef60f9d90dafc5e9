/** Designs of jobs and of the literature, asked from the API. */

import { get } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import { readableJob } from '../../api/readable'
import type { Controller, Evaluation, Job, JobSpec, Scenario } from '../../api/types'
import { placeWord } from '../../format/place'
import type { Design } from '../../format/value'
import type { DesignSource } from './design-source'

/** A design with all that a walk of it needs. */
export interface ResolvedDesign {
  readonly source: DesignSource
  /** For headings and legends. */
  readonly label: string
  readonly robot: JobSpec['robot']
  readonly controller: Controller
  readonly design: Design
  /** What is different from the model where it walks: values of perturbations. */
  readonly world?: Readonly<Record<string, number>>
  /** The job that it is of. */
  readonly job?: Job
  /** Scenarios in which its job judges it; none outside a job. */
  readonly scenarios: readonly Scenario[]
}

/** The design of a source. like: a controller whose published designs are meant if none is named. */
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
    label: 'Design of your own',
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
      'this job fits parameters of the simulation, so its designs drive no controller; its own' +
        ' page shows them',
    )
  }
  const evaluation = await evaluationOf(source, job, signal)
  const name = spec.name || job.id
  return {
    source,
    job,
    label: source.kind === 'best' ? `Best of ${name}` : `${name}, design ${placeWord(evaluation)}`,
    // The evaluations of a certificate are worlds, in which its one design walks.
    ...(spec.kind === 'certificate'
      ? { design: spec.design, world: worldOf(evaluation) }
      : { design: evaluation.design }),
    robot: spec.robot,
    controller: named(controllers, spec.controller),
    scenarios: spec.scenarios.filter((entry) => typeof entry !== 'string'),
  }
}

/** Values of a certificate's perturbations, where our own engine has walked. */
function worldOf(evaluation: Evaluation): Readonly<Record<string, number>> {
  const { engine = 'gaitswarm', ...world } = evaluation.design
  if (engine === 'gaitswarm') return world as Readonly<Record<string, number>>
  throw new ApiProblem(
    422,
    `this walk was computed by ${engine}, which keeps no record of it; the design before it, the` +
      ' first of the job, is the same walk by gaitswarm',
  )
}

async function evaluationOf(
  source: Extract<DesignSource, { job: string }>,
  job: Job,
  signal: AbortSignal,
): Promise<Evaluation> {
  if (source.kind === 'best') {
    if (job.best) return job.best
    throw new ApiProblem(
      404,
      'this job has no design yet that walks in every scenario; wait for it',
    )
  }
  const path = { job_id: source.job, iteration: source.iteration }
  const { items: evaluations } = await get('/v1/jobs/{job_id}/iterations/{iteration}/evaluations', {
    path,
    signal,
  })
  const found = evaluations.find((evaluation) => evaluation.particle === source.particle)
  if (found) return found
  throw new ApiProblem(
    404,
    `iteration ${source.iteration} has no design ${source.particle}, but 0 to ${evaluations.length - 1}`,
  )
}

function published(
  source: Extract<DesignSource, { kind: 'published' }>,
  controllers: readonly Controller[],
  like?: string,
): ResolvedDesign {
  const wanted = source.controller ?? like
  const ordered = [...controllers].sort(
    (a, b) => Number(b.name === wanted) - Number(a.name === wanted),
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
  const known = controllers.flatMap((c) =>
    Object.keys(c.published).map((study) => `${study} of ${c.name}`),
  )
  const of = source.controller ? ` of ${source.controller}` : ''
  throw new ApiProblem(
    404,
    `there is no published design ${source.study}${of}; known are ${known.join(', ')}`,
  )
}

function named(controllers: readonly Controller[], name: string): Controller {
  const found = controllers.find((controller) => controller.name === name)
  if (found) return found
  const known = controllers.map((controller) => controller.name).join(', ')
  throw new ApiProblem(404, `no controller ${name}; known are ${known}`)
}
