/** Formatting of numbers and quantities. */

/** Placeholder of a missing number. */
export const NONE = '–'

const NARROW_SPACE = '\u202f'
const NO_BREAK_SPACE = '\u00a0'
const MINUS = '\u2212'

/** At least `digits` significant digits, all integer digits: 12 345, 8.714, 0.00123, 1.2e-9. */
export function formatNumber(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NONE
  if (value === 0) return '0'
  const size = Math.abs(value)
  if (size < 1e-4 || size >= 1e9) return signed(value.toExponential(Math.min(digits, 3) - 1))
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)))
  return signed(grouped(value.toFixed(Math.min(decimals, 12))))
}

/** formatNumber without trailing zeros: 0.5, 25, 781. */
export function formatExact(value: number | null | undefined, digits = 6): string {
  const text = formatNumber(value, digits)
  if (!text.includes('.') || text.includes('e')) return text
  return text.replace(/\.?0+$/, '')
}

/** A count with grouped digits: 100 000. */
export function formatCount(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NONE
  return signed(grouped(value.toFixed(0)))
}

/** A number with its unit; the unit `1` is omitted. */
export function quantity(value: number | null | undefined, unit: string, digits = 4): string {
  return appendUnit(formatNumber(value, digits), unit)
}

/** quantity without trailing zeros: 2, 0.5 s. */
export function exactQuantity(value: number | null | undefined, unit: string, digits = 5): string {
  return appendUnit(formatExact(value, digits), unit)
}

/** A share in percent: 12.3 %. */
export function percent(share: number | null | undefined, digits = 3): string {
  if (share === null || share === undefined || !Number.isFinite(share)) return NONE
  return quantity(share * 100, '%', digits)
}

/** A signed change: +3.2 %, −0.41. */
export function change(value: number | null | undefined, unit = '1', digits = 3): string {
  const text = quantity(value, unit, digits)
  return typeof value === 'number' && value > 0 ? `+${text}` : text
}

/** A label with its unit in brackets: `energy [J/m]`. */
export function withUnit(label: string, unit: string): string {
  return unit === '1' || unit === '' ? label : `${label} [${writtenUnit(unit)}]`
}

/** Typographic form of an API unit: m/s² for m/s2, Ω for ohm. */
export function writtenUnit(unit: string): string {
  return unit
    .replace(/(?<=[a-z])([23])\b/g, (_, power: string) => (power === '2' ? '²' : '³'))
    .replace(/\bohm\b/, 'Ω')
}

function appendUnit(text: string, unit: string): string {
  return text === NONE || unit === '1' || unit === ''
    ? text
    : text + NO_BREAK_SPACE + writtenUnit(unit)
}

function grouped(text: string): string {
  const [whole, fraction] = text.split('.')
  const digits = whole.replace('-', '')
  if (digits.length < 5) return text
  const groups = digits.replace(/\B(?=(\d{3})+$)/g, NARROW_SPACE)
  return (whole.startsWith('-') ? '-' : '') + groups + (fraction ? `.${fraction}` : '')
}

function signed(text: string): string {
  return text
    .replace('-', MINUS)
    .replace(
      /e\+?(-|−)?(\d+)$/,
      (_, minus: string, power: string) => `e${minus ? MINUS : ''}${power}`,
    )
}
