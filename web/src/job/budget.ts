/** Spent budget of a job. */

import type { Iteration, JobSummary } from '../api/types'
import { formatCount } from '../format/number'

export interface Spent {
  readonly done: number
  readonly planned: number
  /** `designs` if some iterations were smaller than planned, so that there may be more of them. */
  readonly unit: 'iterations' | 'designs'
}

export type Counts = Pick<
  JobSummary,
  'iterations' | 'evaluations' | 'particles' | 'iterations_planned' | 'evaluations_planned'
>

/** followed: iterations received from the stream, which may be ahead of the job. */
export function budgetSpent(job: Counts, followed: readonly Iteration[] = []): Spent {
  const ahead = followed.length > job.iterations
  const iterations = ahead ? followed.length : job.iterations
  const evaluations = ahead ? designsIn(followed) : job.evaluations
  const whole = iterations <= job.iterations_planned && evaluations === iterations * job.particles
  return job.particles === 0 || whole
    ? { done: iterations, planned: job.iterations_planned, unit: 'iterations' }
    : { done: evaluations, planned: job.evaluations_planned, unit: 'designs' }
}

/** Budget spent in full iterations, the lower limit of an extension. */
export function iterationsSpent(job: Counts): number {
  return job.particles === 0 ? job.iterations : Math.ceil(job.evaluations / job.particles)
}

/** `12 of 25`, without the unit. */
export function spentInWords({ done, planned }: Spent): string {
  return `${formatCount(done)} of ${formatCount(planned)}`
}

function designsIn(iterations: readonly Iteration[]): number {
  return iterations.reduce((sum, { designs }) => sum + designs, 0)
}
