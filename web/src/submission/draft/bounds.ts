/** Changes of the search bounds. */

import type { Design } from '../../format/value'
import type { Draft, VariableDraft } from './draft'

/** Share of each variable's range that is searched around the design. */
const SHARE = 0.3

/**
 * Narrow the bounds of the searched variables around a design, within their previous bounds. Choices of
 * categorical variables stay.
 * whole: names of the integer variables.
 */
export function around(draft: Draft, design: Design, whole: ReadonlySet<string>): Draft {
  const narrowed = Object.entries(draft.variables).map(
    ([name, variable]): [string, VariableDraft] => {
      const value = design[name]
      const bounded = variable.mode === 'searched' && variable.choices.length === 0
      if (!bounded || typeof value !== 'number') return [name, variable]
      const [low, high] = [Number(variable.low), Number(variable.high)]
      const reach = ((high - low) * SHARE) / 2
      const from = Math.max(low, Math.min(value - reach, high - 2 * reach))
      const to = Math.min(high, Math.max(value + reach, low + 2 * reach))
      const bounds = whole.has(name)
        ? { low: String(Math.floor(from)), high: String(Math.ceil(to)) }
        : { low: rounded(from), high: rounded(to) }
      return [name, { ...variable, ...bounds, value: rounded(value) }]
    },
  )
  return { ...draft, variables: Object.fromEntries(narrowed) }
}

function rounded(value: number): string {
  return String(Number(value.toPrecision(5)))
}

/**
 * Replace the bounds of searched variables.
 * text: `name:low:high`, comma-separated; invalid entries and variables not searched are ignored.
 */
export function widened(draft: Draft, bounds: string): Draft {
  const variables = { ...draft.variables }
  for (const part of bounds.split(',')) {
    const [name, low, high, ...rest] = part.split(':')
    const variable = variables[name]
    const numbers = [low, high].every((end) => end && Number.isFinite(Number(end)))
    if (variable?.mode !== 'searched' || !numbers || rest.length > 0) continue
    variables[name] = { ...variable, low, high }
  }
  return { ...draft, variables }
}
