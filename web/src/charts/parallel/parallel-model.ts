/** Data of parallel coordinates: positions on the axes, colours and selection. */

import { formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import { type Scale, shareOf, valueAt } from '../scale'

export interface AxisSource {
  readonly name: string
  readonly unit: string
  /** Bounds; derived from the values if null. */
  readonly low: number | null
  readonly high: number | null
  readonly logarithmic: boolean
  /** Names of the choices that the values index; empty for quantities. */
  readonly choices: readonly string[]
  readonly values: Float32Array
}

export interface Axis extends Scale {
  readonly name: string
  readonly unit: string
  readonly choices: readonly string[]
  /** Position of each row, 0 at the low end and 1 at the high end; NaN for none. */
  readonly places: Float32Array
}

export type Brush = readonly [low: number, high: number]

export const BUCKETS = 12
export const FAILED = 255

export interface ParallelModel {
  readonly rows: number
  readonly axes: readonly Axis[]
  /** Colour of each row by rank of fitness: 0 for the best, FAILED for none. */
  readonly buckets: Uint8Array
  /** All rows, ordered so that any prefix is a fair sample. */
  readonly order: Uint32Array
  readonly fitness: Float32Array
}

export function buildModel(sources: readonly AxisSource[], fitness: Float32Array): ParallelModel {
  return {
    rows: fitness.length,
    axes: sources.map(axisOf),
    buckets: bucketsOf(fitness),
    order: shuffledOrder(fitness.length),
    fitness,
  }
}

/** Labels from the low end to the high end: the bounds, or the names of choices. */
export function marksOf(
  axis: Pick<Axis, 'low' | 'high' | 'choices'>,
): readonly (number | string)[] {
  return axis.choices.length > 0 ? axis.choices : [axis.low, axis.high]
}

/** Describe a range of an axis: `2 to 5`, or the choices in it. */
export function stretchOf(axis: Axis, [low, high]: Brush): string {
  if (axis.choices.length > 0) {
    const inside = axis.choices.filter((_, k) => {
      const place = shareOf(axis, k)
      return place >= low && place <= high
    })
    return inside.map(inWords).join(', ') || 'none'
  }
  return [low, high].map((place) => formatExact(valueAt(axis, place), 4)).join(' to ')
}

/** Rows inside every brush, in the model's order. brushes: by index of the axis. */
export function selectRows(
  { axes, order }: ParallelModel,
  brushes: ReadonlyMap<number, Brush>,
): Uint32Array {
  if (brushes.size === 0) return order
  const tests = [...brushes].map(([axis, brush]) => [axes[axis].places, ...brush] as const)
  return order.filter((row) =>
    tests.every(([places, low, high]) => places[row] >= low && places[row] <= high),
  )
}

/** The best of the given rows by fitness, at most `most`. */
export function bestRows({ fitness }: ParallelModel, rows: Uint32Array, most: number): number[] {
  const best: number[] = []
  for (const row of rows) {
    const value = fitness[row]
    if (Number.isNaN(value)) continue
    if (best.length === most && value >= fitness[best[most - 1]]) continue
    let at = best.length
    while (at > 0 && fitness[best[at - 1]] > value) at--
    best.splice(at, 0, row)
    if (best.length > most) best.pop()
  }
  return best
}

function axisOf(source: AxisSource): Axis {
  const { name, unit, values, choices } = source
  let [least, greatest] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  for (const value of values) {
    if (value < least) least = value
    if (value > greatest) greatest = value
  }
  const low = source.low ?? (Number.isFinite(least) ? least : 0)
  let high = source.high ?? (Number.isFinite(greatest) ? greatest : 1)
  if (!(high > low)) high = low + (Math.abs(low) || 1) * 1e-6
  const scale = { name, unit, low, high, choices, logarithmic: source.logarithmic && low > 0 }
  return { ...scale, places: values.map((value) => shareOf(scale, value)) }
}

/** Buckets of equal size, so that a few very bad rows do not take up all colours. */
function bucketsOf(fitness: Float32Array): Uint8Array {
  const finite = fitness.filter((value) => Number.isFinite(value)).sort()
  const limits = Array.from(
    { length: BUCKETS - 1 },
    (_, k) => finite[Math.floor(((k + 1) / BUCKETS) * finite.length)],
  )
  return Uint8Array.from(fitness, (value) => {
    if (!Number.isFinite(value)) return FAILED
    let bucket = 0
    while (bucket < limits.length && value >= limits[bucket]) bucket++
    return bucket
  })
}

/** All rows once, visited with a stride coprime to their number. */
function shuffledOrder(rows: number): Uint32Array {
  const order = new Uint32Array(rows)
  let stride = Math.max(1, Math.round(rows * 0.618))
  while (commonFactor(stride, rows) > 1) stride++
  for (let k = 0, row = 0; k < rows; k++, row = (row + stride) % rows) order[k] = row
  return order
}

function commonFactor(a: number, b: number): number {
  return b === 0 ? a : commonFactor(b, a % b)
}
