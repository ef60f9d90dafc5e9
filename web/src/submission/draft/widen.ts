/** A new search within other bounds. Pure. */

import type { Draft } from './draft'

/**
 * The draft with the bounds of some searched variables replaced.
 * asked: `name:low:high`, separated by commas; what cannot be read or is not searched is left out.
 */
export function widened(draft: Draft, asked: string): Draft {
  const variables = { ...draft.variables }
  for (const part of asked.split(',')) {
    const [name, low, high, ...rest] = part.split(':')
    const variable = variables[name]
    const numbers = [low, high].every((end) => end && Number.isFinite(Number(end)))
    if (variable?.mode !== 'searched' || !numbers || rest.length > 0) continue
    variables[name] = { ...variable, low, high }
  }
  return { ...draft, variables }
}
