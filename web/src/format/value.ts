/** Formatting of design values: numbers and names of choices. */

import { exactQuantity, formatExact, formatNumber, quantity } from './number'
import { inWords } from './words'

/** A number, or the name of a choice of a categorical variable. */
export type Value = number | string

/** Values by variable. */
export type Design = Readonly<Record<string, Value>>

/** formatNumber; names in words. */
export function formatValue(value: Value | null | undefined, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : formatNumber(value, digits)
}

/** formatExact; names in words. */
export function formatExactValue(value: Value | null | undefined, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : formatExact(value, digits)
}

/** quantity; names, which have no unit, in words. */
export function valueQuantity(value: Value, unit: string, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : quantity(value, unit, digits)
}

/** exactQuantity; names, which have no unit, in words. */
export function exactValueQuantity(value: Value, unit: string, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : exactQuantity(value, unit, digits)
}

/** Name of the choice at an index; the number itself without choices. */
export function named(value: number, choices: readonly string[] | undefined): Value {
  return choices?.[Math.round(value)] ?? value
}
