/** Loads designs of jobs and published designs. */

import { get } from '../../api/client'
import { readableJob } from '../../api/jobs'
import { ApiProblem } from '../../api/problem'
import type { Controller, Evaluation, Job, JobSpec, Scenario } from '../../api/types'
import { placeWord } from '../../format/place'
import type { Design } from '../../format/value'
import type { DesignSource } from './design-source'

export interface ResolvedDesign {
  readonly source: DesignSource
  readonly label: string
  readonly robot: JobSpec['robot']
  readonly controller: Controller
  readonly design: Design
  readonly world?: Readonly<Record<string, number>>
  readonly job?: Job
  /** Scenarios of its job; empty without a job. */
  readonly scenarios: readonly Scenario[]
}

type JobSource = Extract<DesignSource, { job: string }>

/** Load the design of a source. like: controller to prefer if the source names none. */
export async function resolveDesign(
  source: DesignSource,
  signal: AbortSignal,
  like?: string,
): Promise<ResolvedDesign> {
  const { items: controllers } = await get('/v1/controllers', { signal })
  const named = (name: string) => {
    const match = controllers.find((controller) => controller.name === name)
    if (match) return match
    const available = controllers.map((controller) => controller.name).join(', ')
    throw new ApiProblem(404, `no controller ${name}; available: ${available}`)
  }
  if ('job' in source) return ofJob(source, named, signal)
  const common = { robot: 'szabadka2-reconstructed', scenarios: [] } as const
  if ('design' in source) {
    const { design } = source
    const controller = named(source.controller)
    return { ...common, source, label: 'Custom design', controller, design }
  }
  const preferred = source.controller ?? like
  const searched = source.controller
    ? [named(source.controller)]
    : controllers.toSorted((a, b) => Number(b.name === preferred) - Number(a.name === preferred))
  for (const controller of searched) {
    const published = source.published || Object.keys(controller.published)[0]
    const design = controller.published[published]
    if (!design) continue
    const label = `Published ${published}, ${controller.name}`
    const exact = { controller: controller.name, published }
    return { ...common, source: exact, label, controller, design }
  }
  const available = controllers.flatMap((c) =>
    Object.keys(c.published).map((study) => `${study} of ${c.name}`),
  )
  const of = source.controller ? ` of ${source.controller}` : ''
  throw new ApiProblem(
    404,
    `there is no published design ${source.published}${of}; available: ${available.join(', ')}`,
  )
}

async function ofJob(
  source: JobSource,
  named: (controller: string) => Controller,
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
    label:
      source.iteration === undefined
        ? `Best of ${name}`
        : `${name}, design ${placeWord(evaluation)}`,
    // Evaluations of a certificate are worlds, all with the same design.
    ...(spec.kind === 'certificate'
      ? { design: spec.design, world: worldOf(evaluation) }
      : { design: evaluation.design }),
    robot: spec.robot,
    controller: named(spec.controller),
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
  { iteration, particle }: JobSource,
  job: Job,
  signal: AbortSignal,
): Promise<Evaluation> {
  if (iteration === undefined) {
    if (job.best) return job.best
    throw new ApiProblem(404, 'no design of this job has succeeded in every scenario yet')
  }
  const { items } = await get('/v1/jobs/{job_id}/iterations/{iteration}/evaluations', {
    path: { job_id: job.id, iteration },
    signal,
  })
  const match = items.find((evaluation) => evaluation.particle === particle)
  if (match) return match
  throw new ApiProblem(
    404,
    `iteration ${iteration} has no design ${particle}; valid are 0 to ${items.length - 1}`,
  )
}
