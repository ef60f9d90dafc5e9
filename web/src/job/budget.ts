/** How much of a job's budget is spent, in the unit that fits it. */

import type { Iteration, JobSummary } from '../api/types'
import { formatCount } from '../format/number'

export interface Spent {
  readonly done: number
  readonly planned: number
  /** `designs` where iterations are smaller than they may be, so that there may be many more. */
  readonly unit: 'iterations' | 'designs'
}

export type Counts = Pick<
  JobSummary,
  'iterations' | 'evaluations' | 'particles' | 'iterations_planned' | 'evaluations_planned'
>

/** followed: iterations that are known from the stream, which may be ahead of the job. */
export function budgetSpent(job: Counts, followed: readonly Iteration[] = []): Spent {
  const ahead = followed.length > job.iterations
  const iterations = ahead ? followed.length : job.iterations
  const evaluations = ahead ? designsIn(followed) : job.evaluations
  const whole = iterations <= job.iterations_planned && evaluations === iterations * job.particles
  return job.particles === 0 || whole
    ? { done: iterations, planned: job.iterations_planned, unit: 'iterations' }
    : { done: evaluations, planned: job.evaluations_planned, unit: 'designs' }
}

/** Whole iterations of the budget that are spent, as far as one can be extended. */
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
