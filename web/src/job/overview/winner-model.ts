/** Positions of the winner's variables between their bounds. */

import type { Variable } from '../../api/types'
import type { Design, Value } from '../../format/value'

/** Share of the range that counts as being at a bound, as in the API's analysis. */
const AT_BOUND = 0.01

export interface WinnerVariable {
  readonly name: string
  readonly value: Value
  readonly unit: string
  /** Search bounds; null for fixed and unbounded variables. */
  readonly low: number | null
  readonly high: number | null
  /** Position between the bounds, 0 to 1; null without bounds. */
  readonly share: number | null
  /** The bound at which the value is, if any. */
  readonly at: 'low' | 'high' | null
  readonly fixed: boolean
}

/** All variables in the design's order: searched ones with their bounds, and fixed ones. */
export function winnerVariables(
  design: Design,
  variables: readonly Variable[],
): readonly WinnerVariable[] {
  const searched = new Map(variables.map((variable) => [variable.name, variable]))
  return Object.entries(design).map(([name, value]) => {
    const variable = searched.get(name)
    const common = { name, value, unit: variable?.unit ?? '1', fixed: variable === undefined }
    const { low = null, high = null } = variable ?? {}
    if (typeof value === 'string' || low === null || high === null || !(high > low)) {
      return { ...common, low: null, high: null, share: null, at: null }
    }
    const share = Math.min(1, Math.max(0, (value - low) / (high - low)))
    const at = share <= AT_BOUND ? 'low' : share >= 1 - AT_BOUND ? 'high' : null
    return { ...common, low, high, share, at }
  })
}
