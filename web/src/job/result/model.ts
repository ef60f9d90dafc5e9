/** What the charts of the result draw: axis range, designs and bars. */

import type { Variable } from '../../api/types'
import { logRange } from '../../charts/scale'
import type { Design, Value } from '../../format/value'
import { columnNamed, type Particles } from '../designs/particles'

/** Margin of the range, as a share of it. */
const ROOM = 0.06

/** Most single designs drawn; beyond, the server returns every n-th iteration. */
export const MOST_DOTS = 1000

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

export interface Dots {
  readonly iterations: Float32Array
  readonly fitness: Float32Array
  readonly total: number
}

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

/** Share of the range that counts as being at a bound, as in the API's analysis. */
const AT_BOUND = 0.01

export interface WinnerVariable {
  readonly name: string
  readonly value: Value
  readonly unit: string
  /** Search bounds; null for fixed and unbounded variables. */
  readonly low: number | null
  readonly high: number | null
  /** Position between the bounds, 0 to 1; null without bounds. */
  readonly share: number | null
  readonly at: 'low' | 'high' | null
  readonly fixed: boolean
}

/** All variables in the design's order: searched ones with their bounds, and fixed ones. */
export function winnerVariables(
  design: Design,
  variables: readonly Variable[],
): readonly WinnerVariable[] {
  const searched = new Map(variables.map((variable) => [variable.name, variable]))
  return Object.entries(design).map(([name, value]) => {
    const variable = searched.get(name)
    const common = { name, value, unit: variable?.unit ?? '1', fixed: variable === undefined }
    const { low = null, high = null } = variable ?? {}
    if (typeof value === 'string' || low === null || high === null || !(high > low)) {
      return { ...common, low: null, high: null, share: null, at: null }
    }
    const share = Math.min(1, Math.max(0, (value - low) / (high - low)))
    const at = share <= AT_BOUND ? 'low' : share >= 1 - AT_BOUND ? 'high' : null
    return { ...common, low, high, share, at }
  })
}
