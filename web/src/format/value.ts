/** Values of a design as people read them: numbers, and names of choices. */

import { exactQuantity, formatExact, formatNumber, quantity } from './number'
import { inWords } from './words'

/** Of a categorical variable the name of a choice. */
export type Value = number | string

/** Values by variable. */
export type Design = Readonly<Record<string, Value>>

/** As formatNumber; a name in words. */
export function formatValue(value: Value | null | undefined, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : formatNumber(value, digits)
}

/** As formatExact; a name in words. */
export function formatExactValue(value: Value | null | undefined, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : formatExact(value, digits)
}

/** As quantity; a name, which has no unit, in words. */
export function valueQuantity(value: Value, unit: string, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : quantity(value, unit, digits)
}

/** As exactQuantity; a name, which has no unit, in words. */
export function exactValueQuantity(value: Value, unit: string, digits?: number): string {
  return typeof value === 'string' ? inWords(value) : exactQuantity(value, unit, digits)
}

/** The name of the choice with an index; the number where there are no choices. */
export function named(value: number, choices: readonly string[] | undefined): Value {
  return choices?.[Math.round(value)] ?? value
}
