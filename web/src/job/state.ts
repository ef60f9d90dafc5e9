/** Meaning of job states. */

import type { Iteration, JobState } from '../api/types'
import { budgetSpent, type Counts } from './budget'

interface WithState {
  readonly state: JobState
}

/** Whether the job is in a final state. */
export function hasEnded({ state }: WithState): boolean {
  return state === 'succeeded' || state === 'failed' || state === 'cancelled'
}

/** Whether the job will progress without a command. */
export function isActive(job: WithState): boolean {
  return job.state === 'queued' || isRunning(job)
}

/** Whether the job is being computed. */
export function isRunning({ state }: WithState): boolean {
  return state === 'running' || state === 'pausing'
}

/** `running 3/6`, or the final state. followed: iterations received from the stream. */
export function progressInWords(
  job: Counts & WithState,
  followed: readonly Iteration[] = [],
): string {
  const { done, planned } = budgetSpent(job, followed)
  return hasEnded(job) ? job.state : `${job.state} ${done}/${planned}`
}
