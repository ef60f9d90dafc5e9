/** Where the search of a new job begins: the best of earlier jobs, or designs of a cloned one. Pure. */

import type { JobSpec } from '../../api/types'
import type { Design } from '../../format/value'

export interface StartDraft {
  /** Ids of jobs. */
  readonly jobs: readonly string[]
  /** Designs of these jobs in all, at most. */
  readonly count: string
  /** Designs that a cloned job began with; they count where no job is named. */
  readonly designs: readonly Design[]
}

export const NO_START: StartDraft = { jobs: [], count: '5', designs: [] }

/** The start of a spec that was submitted before; its jobs have become designs. */
export function startDraft(start: JobSpec['start']): StartDraft {
  if (start === undefined) return NO_START
  if (Array.isArray(start)) return { ...NO_START, designs: start as readonly Design[] }
  const { jobs, count } = start as { jobs: readonly string[]; count?: number }
  return { ...NO_START, jobs, count: String(count ?? NO_START.count) }
}

/** What the spec says of the start; undefined for a search that begins anywhere. */
export function startOf({ jobs, count, designs }: StartDraft): JobSpec['start'] | undefined {
  if (jobs.length > 0) {
    const most = Number(count)
    const usable = count.trim() !== '' && !Number.isNaN(most)
    return { jobs, count: usable ? most : count } as JobSpec['start']
  }
  return designs.length > 0 ? (designs as JobSpec['start']) : undefined
}
