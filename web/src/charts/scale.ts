/** Linear and logarithmic scales; a logarithmic one may span less than a decade. */

import { formatExact } from '../format/number'

export interface Scale {
  readonly low: number
  readonly high: number
  readonly logarithmic: boolean
}

/** Position of a value between the ends, 0 to 1. */
export function shareOf({ low, high, logarithmic }: Scale, value: number): number {
  return logarithmic ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)
}

export function valueAt({ low, high, logarithmic }: Scale, share: number): number {
  return logarithmic ? low * (high / low) ** share : low + share * (high - low)
}

/** The range of the data with a margin. */
export function logRange(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !(low > 0)) return [1, 10]
  const room = Math.max((high / low) ** 0.05, 1.02)
  return [low / room, high * room]
}

/** A tick's position between the ends of an axis, 0 to 1, and its label. */
export type Tick = readonly [share: number, text: string]

export function ticksOf(scale: Scale, count = 6): Tick[] {
  const { low, high, logarithmic } = scale
  if (!(high > low)) return []
  const values = logarithmic ? logTicks(low, high) : linearTicks(low, high, count)
  return values.map((value) => [shareOf(scale, value), formatExact(value, 5)])
}

/** Four to ten round numbers in a range. */
export function logTicks(low: number, high: number): number[] {
  if (!(low > 0) || !(high > low)) return [low]
  const decades = Math.log10(high / low)
  if (decades < 1) return linearTicks(low, high)
  const every = Math.max(1, Math.ceil(decades / 8))
  const factors = decades < 3 ? [1, 2, 5] : [1]
  const ticks: number[] = []
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    if (power % every !== 0) continue
    for (const factor of factors) ticks.push(Number(`${factor}e${power}`))
  }
  return ticks.filter((tick) => tick >= low && tick <= high)
}

/** Multiples of 1, 2 or 5 times a power of ten in a range. */
export function linearTicks(low: number, high: number, count = 6): number[] {
  const rough = (high - low) / count
  const power = 10 ** Math.floor(Math.log10(rough))
  const step = ([1, 2, 5, 10].find((factor) => factor * power >= rough) ?? 10) * power
  const ticks: number[] = []
  for (let n = Math.ceil(low / step - 1e-9); n <= high / step + 1e-9; n++) {
    ticks.push(Number((n * step).toPrecision(12)))
  }
  return ticks
}

/** Index of the point nearest to a position, within reach; null if there is none. */
export function nearest(
  points: Iterable<readonly [index: number, x: number, y: number]>,
  [x, y]: readonly [number, number],
  reach: number,
): number | null {
  let [closest, least]: [number | null, number] = [null, reach]
  for (const [index, px, py] of points) {
    const distance = Math.hypot(px - x, py - y)
    if (distance <= least) [closest, least] = [index, distance]
  }
  return closest
}
