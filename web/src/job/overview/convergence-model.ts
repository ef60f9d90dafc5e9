/** What the convergence chart shows: the range that fits best and median, and what lies above it. Pure. */

import { logRange } from '../../charts/log-axis'
import { columnNamed, type Particles } from '../designs/particles'

/** Room around what the range is to fit, as a share of it. */
const ROOM = 0.06

/** Single designs that are drawn at most; of more, the server takes every so manieth iteration. */
export const MOST_DOTS = 10_000

/** A series of fitness by iteration; null where there is none. */
export type Line = ArrayLike<number | null>

/** Fitness that the axis shows: all of the lines and of the levels to compare with, with a little room. */
export function fittedRange(
  lines: readonly Line[],
  levels: readonly number[],
  logarithmic: boolean,
): readonly [number, number] | null {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  const take = (value: number | null) => {
    if (value === null || !Number.isFinite(value) || (logarithmic && value <= 0)) return
    low = Math.min(low, value)
    high = Math.max(high, value)
  }
  for (const line of lines) for (let k = 0; k < line.length; k++) take(line[k])
  if (low > high) return null
  // Levels alone are no reason to show a chart of nothing else.
  levels.forEach(take)
  if (logarithmic) return logRange(low, high)
  const room = high > low ? ROOM * (high - low) : Math.max(Math.abs(high) * ROOM, 1e-9)
  return [low - room, high + room]
}

/** Single designs, by column. */
export interface Dots {
  readonly iterations: Float32Array
  readonly fitness: Float32Array
  /** Designs that the job has, of which these are some. */
  readonly total: number
}

/** Those designs that walked in every case. */
export function dotsOf(particles: Particles): Dots | null {
  const iterations = columnNamed(particles, 'iteration')?.values
  const fitness = columnNamed(particles, 'fitness')?.values
  if (!iterations || !fitness) return null
  const kept = [...fitness.keys()].filter((row) => Number.isFinite(fitness[row]))
  return {
    iterations: Float32Array.from(kept, (row) => iterations[row]),
    fitness: Float32Array.from(kept, (row) => fitness[row]),
    total: particles.total,
  }
}

/** Iterations in which something lies above the range, so that it is marked at the edge. */
export function iterationsAbove(
  range: readonly [number, number] | null,
  x: readonly number[],
  highest: Line | null,
  dots: Dots | null,
): ReadonlySet<number> {
  const found = new Set<number>()
  if (range === null) return found
  if (highest) {
    for (let k = 0; k < x.length; k++) if ((highest[k] ?? 0) > range[1]) found.add(x[k])
  }
  if (dots) {
    for (let row = 0; row < dots.fitness.length; row++) {
      if (dots.fitness[row] > range[1]) found.add(dots.iterations[row])
    }
  }
  return found
}
