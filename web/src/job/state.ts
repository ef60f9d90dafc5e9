/** What the state of a job says of it. Pure. */

import type { Iteration, JobState } from '../api/types'
import { budgetSpent, type Counts } from './budget'

interface WithState {
  readonly state: JobState
}

/** Whether nothing more is to come of it, whatever anybody does. */
export function hasEnded({ state }: WithState): boolean {
  return state === 'succeeded' || state === 'failed' || state === 'cancelled'
}

/** Whether more is to come of it without anybody's doing. */
export function isUnderWay(job: WithState): boolean {
  return job.state === 'queued' || isComputed(job)
}

/** Whether it is worked on now. */
export function isComputed({ state }: WithState): boolean {
  return state === 'running' || state === 'pausing'
}

/** `running 3/6`, or how it ended. followed: iterations that are known from the stream. */
export function progressInWords(
  job: Counts & WithState,
  followed: readonly Iteration[] = [],
): string {
  const { done, planned } = budgetSpent(job, followed)
  return hasEnded(job) ? job.state : `${job.state} ${done}/${planned}`
}
