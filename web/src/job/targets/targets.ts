/** Targets of a calibration: tolerance checks and leave-one-out. */

import type { Targets } from '../../api/types'

export type LeaveOut = 'target' | 'walk'

export const LEFT_OUT: readonly { readonly what: LeaveOut; readonly words: string }[] = [
  { what: 'target', words: 'itself' },
  { what: 'walk', words: 'all targets of its walk' },
]

/** Parse a query such as `?leave_out=walk`; null for nothing. */
export function leaveOutOf(query: URLSearchParams): LeaveOut | null {
  const word = query.get('leave_out')
  return LEFT_OUT.find(({ what }) => what === word)?.what ?? null
}

/** Whether a difference in tolerances is at most one; false for a failure. */
export function isWithin(difference: number | null): boolean {
  return difference !== null && Math.abs(difference) <= 1
}

/** Number of fitted targets, and of those within tolerance. */
export function withinCount({ targets }: Pick<Targets, 'targets'>): {
  readonly within: number
  readonly fitted: number
} {
  const fitted = targets.filter(({ use }) => use === 'fit')
  const within = fitted.filter(({ difference }) => isWithin(difference))
  return { within: within.length, fitted: fitted.length }
}
