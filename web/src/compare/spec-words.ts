/** Values of specs in words. */

import { formatExact, NONE } from '../format/number'
import { inWords } from '../format/words'

/** json: a value as the API compares it; text that is no JSON is in words already. */
export function specWords(json: string | null | undefined): string {
  if (json === null || json === undefined) return NONE
  try {
    return inParts(JSON.parse(json))
  } catch {
    return json
  }
}

function inParts(value: unknown): string {
  if (value === null) return NONE
  if (typeof value === 'number') return formatExact(value)
  if (typeof value === 'boolean') return value ? 'yes' : 'no'
  if (Array.isArray(value)) return value.map(inParts).join(', ') || 'none'
  if (typeof value !== 'object') return String(value)
  const parts = Object.entries(value).map(([name, part]) => `${inWords(name)} ${inParts(part)}`)
  return parts.join(', ') || 'none'
}
