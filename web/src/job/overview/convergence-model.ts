/** Axis range of the convergence chart, and values outside of it. */

import { logRange } from '../../charts/log-axis'
import { columnNamed, type Particles } from '../designs/particles'

/** Margin of the range, as a share of it. */
const ROOM = 0.06

/** Most single designs drawn; beyond, the server returns every n-th iteration. */
export const MOST_DOTS = 10_000

/** Fitness by iteration; null if missing. */
export type Line = ArrayLike<number | null>

/** Range of the axis: all lines and reference levels, with a margin. */
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
  // Levels without lines are not worth a chart.
  levels.forEach(take)
  if (logarithmic) return logRange(low, high)
  const room = high > low ? ROOM * (high - low) : Math.max(Math.abs(high) * ROOM, 1e-9)
  return [low - room, high + room]
}

/** Single designs by column. */
export interface Dots {
  readonly iterations: Float32Array
  readonly fitness: Float32Array
  /** Number of designs of the job. */
  readonly total: number
}

/** The designs that succeeded in every scenario. */
export function dotsOf(particles: Particles): Dots | null {
  const iterations = columnNamed(particles, 'iteration')?.values
  const fitness = columnNamed(particles, 'fitness')?.values
  if (!iterations || !fitness) return null
  const finiteRows = [...fitness.keys()].filter((row) => Number.isFinite(fitness[row]))
  return {
    iterations: Float32Array.from(finiteRows, (row) => iterations[row]),
    fitness: Float32Array.from(finiteRows, (row) => fitness[row]),
    total: particles.total,
  }
}

/** Iterations with values above the range, marked at the edge. */
export function iterationsAbove(
  range: readonly [number, number] | null,
  x: readonly number[],
  highest: Line | null,
  dots: Dots | null,
): ReadonlySet<number> {
  const above = new Set<number>()
  if (range === null) return above
  if (highest) {
    for (let k = 0; k < x.length; k++) if ((highest[k] ?? 0) > range[1]) above.add(x[k])
  }
  if (dots) {
    for (let row = 0; row < dots.fitness.length; row++) {
      if (dots.fitness[row] > range[1]) above.add(dots.iterations[row])
    }
  }
  return above
}
