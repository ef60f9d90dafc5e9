/** Search within other bounds. */

import type { Draft } from './draft'

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
