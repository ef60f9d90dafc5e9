/** Positions of points, ticks and labels of a scatter chart. */

import { linearTicks, logRange, logTicks } from '../log-axis'

/** Values by point. */
export type Values = ArrayLike<number>

/** Range, scale and ticks of an axis. */
export interface Axis {
  readonly low: number
  readonly high: number
  readonly logarithmic: boolean
  readonly ticks: readonly number[]
}

/** A rectangle [px]. */
export interface Box {
  readonly left: number
  readonly top: number
  readonly width: number
  readonly height: number
}

/** Margin before the first and after the last value, as a share of the range. */
const ROOM = 0.05

/** An axis for all finite values; logarithmic only if all are positive. */
export function axisOf(columns: readonly Values[], logarithmic: boolean): Axis {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  for (const values of columns) {
    for (let k = 0; k < values.length; k++) {
      if (!Number.isFinite(values[k])) continue
      low = Math.min(low, values[k])
      high = Math.max(high, values[k])
    }
  }
  if (!(low <= high)) return { low: 0, high: 1, logarithmic: false, ticks: linearTicks(0, 1) }
  if (logarithmic && low > 0) {
    const [from, to] = logRange(low, high)
    return { low: from, high: to, logarithmic: true, ticks: logTicks(from, to) }
  }
  const room = (high - low) * ROOM || Math.abs(high) * ROOM || 1
  const [from, to] = [low - room, high + room]
  return { low: from, high: to, logarithmic: false, ticks: linearTicks(from, to) }
}

/** Position of a value on an axis, 0 to 1. */
export function shareOf({ low, high, logarithmic }: Axis, value: number): number {
  if (logarithmic) return Math.log(value / low) / Math.log(high / low)
  return (value - low) / (high - low)
}

/** Position of a point in a box [px], y upwards. */
export function placeIn(box: Box, x: Axis, y: Axis, px: number, py: number): [number, number] {
  return [box.left + shareOf(x, px) * box.width, box.top + (1 - shareOf(y, py)) * box.height]
}

/** The point nearest to a position, within reach [px]; null if there is none. */
export function nearest(
  places: readonly (readonly [number, number])[],
  at: readonly [number, number],
  reach: number,
): number | null {
  let [closest, least]: [number | null, number] = [null, reach]
  for (const [index, [x, y]] of places.entries()) {
    const distance = Math.hypot(x - at[0], y - at[1])
    if (distance <= least) [closest, least] = [index, distance]
  }
  return closest
}

/** A label to place near a point. */
export interface Name {
  readonly at: readonly [number, number]
  /** Width of the text [px]. */
  readonly width: number
}

/**
 * Positions of labels [px], left and middle of each: next to, above or below the point, inside the box
 * and not overlapping earlier labels; null if there is no such position.
 */
export function placeNames(
  names: readonly Name[],
  box: Box,
  height: number,
  gap: number,
): readonly (readonly [number, number] | null)[] {
  const occupied: Box[] = []
  return names.map(({ at: [x, y], width }) => {
    const candidates = [
      [x + gap, y],
      [x - gap - width, y],
      [x - width / 2, y - gap - height / 2],
      [x - width / 2, y + gap + height / 2],
      [x + gap, y - height],
      [x + gap, y + height],
      [x - gap - width, y - height],
      [x - gap - width, y + height],
    ] as const
    for (const [left, middle] of candidates) {
      const rect = { left, top: middle - height / 2, width, height }
      if (!isWithin(rect, box) || occupied.some((other) => overlap(rect, other))) continue
      occupied.push(rect)
      return [left, middle] as const
    }
    return null
  })
}

function isWithin(rect: Box, box: Box): boolean {
  return (
    rect.left >= box.left &&
    rect.top >= box.top &&
    rect.left + rect.width <= box.left + box.width &&
    rect.top + rect.height <= box.top + box.height
  )
}

function overlap(a: Box, b: Box): boolean {
  return (
    a.left < b.left + b.width &&
    b.left < a.left + a.width &&
    a.top < b.top + b.height &&
    b.top < a.top + a.height
  )
}
