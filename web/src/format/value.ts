/** Formatting of design values: numbers and names of choices. */

import { exactQuantity, formatExact, formatNumber, quantity } from './number'
import { inWords } from './words'

/** A number, or the name of a choice of a categorical variable. */
export type Value = number | string

export type Design = Readonly<Record<string, Value>>

/** A number format that writes names in words. */
function orName<A extends unknown[]>(
  format: (value: number | null | undefined, ...rest: A) => string,
) {
  return (value: Value | null | undefined, ...rest: A) =>
    typeof value === 'string' ? inWords(value) : format(value, ...rest)
}

export const formatValue = orName(formatNumber)
export const formatExactValue = orName(formatExact)
export const valueQuantity = orName(quantity)
export const exactValueQuantity = orName(exactQuantity)

/** Name of the choice at an index; the number itself without choices. */
export function named(value: number, choices: readonly string[] | undefined): Value {
  return choices?.[Math.round(value)] ?? value
}
