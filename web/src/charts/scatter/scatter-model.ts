/** Where points, ticks and names of a scatter chart lie on its canvas. Pure. */

import { linearTicks, logRange, logTicks } from '../log-axis'

/** Values by point. */
export type Values = ArrayLike<number>

/** An axis: what its ends stand for, and where its round numbers are. */
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

/** Room beside the first and the last value, as a share of the range. */
const ROOM = 0.05

/** An axis that shows all values that are finite; logarithmic only if all are positive. */
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

/** Place of a value between the ends of an axis, 0 to 1. */
export function shareOf({ low, high, logarithmic }: Axis, value: number): number {
  if (logarithmic) return Math.log(value / low) / Math.log(high / low)
  return (value - low) / (high - low)
}

/** Place of a point in a box [px], y upwards. */
export function placeIn(box: Box, x: Axis, y: Axis, px: number, py: number): [number, number] {
  return [box.left + shareOf(x, px) * box.width, box.top + (1 - shareOf(y, py)) * box.height]
}

/** The point that is nearest to a place, if it is within reach [px]; null if none is. */
export function nearest(
  places: readonly (readonly [number, number])[],
  at: readonly [number, number],
  reach: number,
): number | null {
  let [found, least]: [number | null, number] = [null, reach]
  for (const [index, [x, y]] of places.entries()) {
    const distance = Math.hypot(x - at[0], y - at[1])
    if (distance <= least) [found, least] = [index, distance]
  }
  return found
}

/** A name that is to stand beside a point. */
export interface Name {
  readonly at: readonly [number, number]
  /** Of the text [px]. */
  readonly width: number
}

/**
 * Places of names [px], left and middle of each: beside, above or below its point, inside the box and clear of
 * the names before; null where there is no such place.
 */
export function placeNames(
  names: readonly Name[],
  box: Box,
  height: number,
  gap: number,
): readonly (readonly [number, number] | null)[] {
  const taken: Box[] = []
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
      const own = { left, top: middle - height / 2, width, height }
      if (!isWithin(own, box) || taken.some((other) => overlap(own, other))) continue
      taken.push(own)
      return [left, middle] as const
    }
    return null
  })
}

function isWithin(own: Box, box: Box): boolean {
  return (
    own.left >= box.left &&
    own.top >= box.top &&
    own.left + own.width <= box.left + box.width &&
    own.top + own.height <= box.top + box.height
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
