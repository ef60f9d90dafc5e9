/** State and progress of a job. */

import type { JobState } from '../api/types'

type Tone = 'muted' | 'accent' | 'good' | 'warn' | 'bad'

const TONES: Readonly<Record<JobState, Tone>> = {
  queued: 'muted',
  running: 'accent',
  pausing: 'warn',
  paused: 'warn',
  cancelled: 'muted',
  failed: 'bad',
  succeeded: 'good',
}

export interface Outcome {
  readonly text: string
  readonly tone: Tone
}

/** outcome: shown in place of the state. */
export function StateBadge({ state, outcome }: { state: JobState; outcome?: Outcome | null }) {
  const { text, tone } = outcome ?? { text: state, tone: TONES[state] }
  return (
    <span class="badge" data-tone={tone} data-state={state}>
      {text}
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
