/** Scales and labels of a scatter chart. */

import type { Box } from '../canvas'
import { logRange, type Scale } from '../scale'

/** Margin before the first and after the last value, as a share of the range. */
const ROOM = 0.05

/** A scale for all finite values; logarithmic only if all are positive. */
export function scaleOf(columns: readonly ArrayLike<number>[], logarithmic: boolean): Scale {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  for (const values of columns) {
    for (let k = 0; k < values.length; k++) {
      if (!Number.isFinite(values[k])) continue
      low = Math.min(low, values[k])
      high = Math.max(high, values[k])
    }
  }
  if (!(low <= high)) return { low: 0, high: 1, logarithmic: false }
  if (logarithmic && low > 0) {
    const [from, to] = logRange(low, high)
    return { low: from, high: to, logarithmic }
  }
  const room = (high - low) * ROOM || Math.abs(high) * ROOM || 1
  return { low: low - room, high: high + room, logarithmic: false }
}

/** A label to place near a point. */
interface Name {
  readonly at: readonly [number, number]
  /** Width of the text [px]. */
  readonly width: number
}

/**
 * Positions of labels [px], left and middle of each: next to, above or below the point, inside the box
 * and not overlapping earlier labels; null if there is no such position.
 */
export function placeNames(names: readonly Name[], box: Box, height: number, gap: number) {
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
    const chosen = candidates.find(([left, middle]) => {
      const rect = { left, top: middle - height / 2, width, height }
      if (!isWithin(rect, box) || occupied.some((other) => overlap(rect, other))) return false
      occupied.push(rect)
      return true
    })
    return chosen ?? null
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
