/** Start of a search: the best of earlier jobs, or designs of a cloned one. */

import type { JobSpec } from '../../api/types'
import type { Design } from '../../format/value'

export interface StartDraft {
  readonly jobs: readonly string[]
  /** Total number of designs of these jobs, at most. */
  readonly count: string
  /** Start designs of a cloned job; used if `jobs` is empty. */
  readonly designs: readonly Design[]
}

export const NO_START: StartDraft = { jobs: [], count: '5', designs: [] }

/** Draft of a spec's start, in which jobs were resolved to designs. */
export function startDraft(start: JobSpec['start']): StartDraft {
  if (start === undefined) return NO_START
  if (Array.isArray(start)) return { ...NO_START, designs: start as readonly Design[] }
  const { jobs, count } = start as { jobs: readonly string[]; count?: number }
  return { ...NO_START, jobs, count: String(count ?? NO_START.count) }
}

export function startOf({ jobs, count, designs }: StartDraft): JobSpec['start'] | undefined {
  if (jobs.length > 0) {
    const most = Number(count)
    const usable = count.trim() !== '' && !Number.isNaN(most)
    return { jobs, count: usable ? most : count } as JobSpec['start']
  }
  return designs.length > 0 ? (designs as JobSpec['start']) : undefined
}
