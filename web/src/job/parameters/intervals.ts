/** Intervals of fitted parameters among good designs (fig. 2.14). */

import type { FittedParameter, Identifiability } from '../../api/types'
import type { Value } from '../../format/value'

export type Trust = NonNullable<FittedParameter['trust']>

const TRUSTS: readonly Trust[] = ['trusted', 'rough', 'unknown']

export const WIDTHS = [0.2, 0.1, 0.05, 0.02] as const

export const DECISIVE = 0.05

export function isCategorical({ choices }: FittedParameter): boolean {
  return choices.length > 0
}

/** Width of the interval at a threshold, as a share of the search range; null if there is none. */
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

export function rankOf({ trust }: FittedParameter): number | null {
  return trust === null ? null : TRUSTS.indexOf(trust)
}

export function verdicts({ parameters }: Identifiability) {
  return TRUSTS.map((trust) => {
    const matches = parameters.filter((parameter) => parameter.trust === trust)
    return { trust, count: matches.length, explanation: matches[0]?.explanation ?? null }
  })
}

/** Position of a threshold from the smallest (0) to the largest (1), logarithmic. */
export function placeOf(threshold: number, thresholds: readonly number[]): number {
  const [least, greatest] = [Math.min(...thresholds), Math.max(...thresholds)]
  if (least === greatest) return 0
  return Math.log(threshold / least) / Math.log(greatest / least)
}

export function shareOf(value: Value, { low, high }: FittedParameter): number {
  return (Number(value) - low) / (high - low)
}

/** Outline of the intervals over the thresholds, as an SVG path in a box of the given size. */
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
