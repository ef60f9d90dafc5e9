/** State and progress of a job. */

import type { JobState } from '../api/types'

const TONES: Readonly<Record<JobState, 'muted' | 'accent' | 'good' | 'warn' | 'bad'>> = {
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
    <span class="badge" data-tone={TONES[state]} data-state={state}>
      {state}
    </span>
  )
}

interface ProgressProps {
  done: number
  planned: number
  label: string
  state?: JobState
}

export function Progress({ done, planned, label, state }: ProgressProps) {
  const share = planned > 0 ? Math.min(1, done / planned) : 0
  return (
    <span
      class="progress"
      data-tone={state === 'succeeded' ? 'good' : state === 'failed' ? 'bad' : 'accent'}
      role="progressbar"
      aria-label={label}
      aria-valuemin={0}
      aria-valuemax={planned}
      aria-valuenow={done}
    >
      <span style={{ width: `${share * 100}%` }} />
    </span>
  )
}
