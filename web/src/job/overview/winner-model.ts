/** Where in its bounds each variable of the winner lies. Pure. */

import type { Variable } from '../../api/types'
import type { Design, Value } from '../../format/value'

/** Share of the range within which a value lies at a bound, as the analysis has it. */
const AT_BOUND = 0.01

export interface Placed {
  readonly name: string
  readonly value: Value
  readonly unit: string
  /** Bounds of the search; null for what is held fixed or has none. */
  readonly low: number | null
  readonly high: number | null
  /** Where between them the value lies, 0 to 1; null where there are none. */
  readonly share: number | null
  /** The bound at which it lies, if any. */
  readonly at: 'low' | 'high' | null
  readonly fixed: boolean
}

/** In the order of the design: the searched variables with their bounds, and those held fixed. */
export function placed(design: Design, variables: readonly Variable[]): readonly Placed[] {
  const searched = new Map(variables.map((variable) => [variable.name, variable]))
  return Object.entries(design).map(([name, value]) => {
    const variable = searched.get(name)
    const known = { name, value, unit: variable?.unit ?? '1', fixed: variable === undefined }
    const { low = null, high = null } = variable ?? {}
    if (typeof value === 'string' || low === null || high === null || !(high > low)) {
      return { ...known, low: null, high: null, share: null, at: null }
    }
    const share = Math.min(1, Math.max(0, (value - low) / (high - low)))
    const at = share <= AT_BOUND ? 'low' : share >= 1 - AT_BOUND ? 'high' : null
    return { ...known, low, high, share, at }
  })
}
