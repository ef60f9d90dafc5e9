/** A job's state as a coloured badge. */

import type { JobState } from '../api/types'

export const STATE_TONES: Readonly<Record<JobState, 'muted' | 'accent' | 'good' | 'warn' | 'bad'>> =
  {
    queued: 'muted',
    running: 'accent',
    pausing: 'warn',
    paused: 'warn',
    cancelled: 'muted',
    failed: 'bad',
    succeeded: 'good',
  }

export function StateBadge({ state }: { state: JobState }) {
  return (
    <span class="badge" data-tone={STATE_TONES[state]} data-state={state}>
      {state}
    </span>
  )
}
