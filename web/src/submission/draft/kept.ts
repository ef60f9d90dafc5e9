/** Draft of a new job, kept in this browser until it is submitted. */

import type { Draft } from './draft'

const KEY = 'gaitswarm.draft'

/** null forgets it. */
export function keepDraft(draft: Draft | null): void {
  if (draft === null) localStorage.removeItem(KEY)
  else localStorage.setItem(KEY, JSON.stringify(draft))
}

export function forgetDraft(): void {
  keepDraft(null)
}

export function keptDraft(): Partial<Draft> | null {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? 'null') as Partial<Draft> | null
  } catch {
    return null
  }
}
