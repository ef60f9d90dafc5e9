/** Intervals of fitted parameters among good designs (fig. 2.14 of the thesis). Pure. */

import type { FittedParameter, Identifiability } from '../../api/types'
import type { Value } from '../../format/value'

export type Trust = NonNullable<FittedParameter['trust']>

/** From the best to the worst. */
const TRUSTS: readonly Trust[] = ['trusted', 'rough', 'unknown']

/** Thresholds whose widths are listed. */
export const LISTED = [0.2, 0.1, 0.05, 0.02] as const

/** Threshold at which a parameter is judged. */
export const DECISIVE = 0.05

/** Whether a parameter is one of several choices, between which there are no intervals. */
export function isCategorical({ choices }: FittedParameter): boolean {
  return choices.length > 0
}

/** Width of the interval at a threshold, as a share of the range searched; null if there is none. */
export function widthAt(
  { thresholds }: Identifiability,
  parameter: FittedParameter,
  threshold: number,
): number | null {
  const { intervals, low, high } = parameter
  const interval = intervals[thresholds.indexOf(threshold)]
  return interval && !isCategorical(parameter)
    ? (interval.high - interval.low) / (high - low)
    : null
}

/** A parameter's verdict as a number to sort by; those without one come last. */
export function rankOf({ trust }: FittedParameter): number | null {
  return trust === null ? null : TRUSTS.indexOf(trust)
}

/** The verdicts that were given, each with its meaning and the number of parameters. */
export function verdicts({ parameters }: Identifiability) {
  return TRUSTS.map((trust) => {
    const found = parameters.filter((parameter) => parameter.trust === trust)
    return { trust, count: found.length, explanation: found[0]?.explanation ?? null }
  })
}

/** Where a threshold lies from the least (0) to the greatest (1), by its logarithm. */
export function placeOf(threshold: number, thresholds: readonly number[]): number {
  const [least, greatest] = [Math.min(...thresholds), Math.max(...thresholds)]
  if (least === greatest) return 0
  return Math.log(threshold / least) / Math.log(greatest / least)
}

/** The share of its range at which a value lies: 0 at the lower bound, 1 at the upper. */
export function shareOf(value: Value, { low, high }: FittedParameter): number {
  return (Number(value) - low) / (high - low)
}

/** Outline of the intervals over the thresholds, as an SVG path in a box of that size. */
export function outline(
  { thresholds }: Identifiability,
  parameter: FittedParameter,
  width: number,
  height: number,
): string {
  const point = (k: number, value: number) => {
    const x = placeOf(thresholds[k], thresholds) * width
    const y = (1 - shareOf(value, parameter)) * height
    return `${x.toFixed(1)} ${y.toFixed(1)}`
  }
  const upper = parameter.intervals.map(({ high }, k) => point(k, high))
  const lower = parameter.intervals.map(({ low }, k) => point(k, low))
  return `M${[...upper, ...lower.reverse()].join('L')}Z`
}
