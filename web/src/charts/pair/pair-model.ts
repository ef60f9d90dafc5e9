/** Two axes of parallel coordinates set against each other: points, cells, what a drag selects. Pure. */

import { exactQuantity, formatCount, formatExact, formatNumber } from '../../format/number'
import { inWords } from '../../format/words'
import { linearTicks, logTicks } from '../log-axis'
import {
  type Axis,
  type Brush,
  BUCKETS,
  FAILED,
  marksOf,
  type ParallelModel,
  placeOf,
  stretchOf,
  valueAt,
} from '../parallel/parallel-model'

/** Rows that are looked at; of more, a fair sample. */
export const SAMPLE = 4000

/** Columns and rows of the cells. */
export const CELLS = 14

/** Designs of one cell. */
export interface Cell {
  /** From the left and from below, from 0. */
  readonly column: number
  readonly row: number
  readonly designs: number
  /** Mean of the buckets of those that have a fitness; null where none has. */
  readonly bucket: number | null
}

/** A sample of some rows, in the model's order. */
export function sampleOf(rows: Uint32Array): Uint32Array {
  return rows.subarray(0, SAMPLE)
}

/** Cells in which there are designs: how they rank on average. */
export function cellsOf(model: ParallelModel, rows: Uint32Array, x: number, y: number) {
  const [xs, ys] = [model.axes[x].places, model.axes[y].places]
  const counted = new Map<number, { designs: number; judged: number; sum: number }>()
  for (const row of sampleOf(rows)) {
    const [column, line] = [cellAt(xs[row]), cellAt(ys[row])]
    if (column === null || line === null) continue
    const key = line * CELLS + column
    const cell = counted.get(key) ?? { designs: 0, judged: 0, sum: 0 }
    cell.designs++
    if (model.buckets[row] !== FAILED) {
      cell.judged++
      cell.sum += model.buckets[row]
    }
    counted.set(key, cell)
  }
  return [...counted].map(
    ([key, { designs, judged, sum }]): Cell => ({
      column: key % CELLS,
      row: Math.floor(key / CELLS),
      designs,
      bucket: judged === 0 ? null : sum / judged,
    }),
  )
}

/** Stretches of both axes that a drag from one place to another selects. */
export function dragged(
  from: readonly [number, number],
  to: readonly [number, number],
): readonly [Brush, Brush] {
  const stretch = (k: 0 | 1): Brush => [
    clamped(Math.min(from[k], to[k])),
    clamped(Math.max(from[k], to[k])),
  ]
  return [stretch(0), stretch(1)]
}

/** The row of those sampled that is nearest to a place, within reach; null if none is. */
export function nearestRow(
  model: ParallelModel,
  rows: Uint32Array,
  [x, y]: readonly [number, number],
  at: readonly [number, number],
  reach: number,
): number | null {
  const [xs, ys] = [model.axes[x].places, model.axes[y].places]
  let [found, least]: [number | null, number] = [null, reach]
  for (const row of sampleOf(rows)) {
    const distance = Math.hypot(xs[row] - at[0], ys[row] - at[1])
    if (distance < least) [found, least] = [row, distance]
  }
  return found
}

/** Where an axis is marked, and with what: round numbers, or names of choices. */
export function ticksOf(axis: Axis): readonly { readonly place: number; readonly text: string }[] {
  if (axis.choices.length > 0) {
    return marksOf(axis).map((name, k) => ({ place: placeOf(axis, k), text: inWords(`${name}`) }))
  }
  const { low, high } = axis
  const values = axis.logarithmic ? logTicks(low, high) : linearTicks(low, high, 5)
  return values
    .map((value) => ({ place: placeOf(axis, value), text: formatExact(value, 4) }))
    .filter(({ place }) => place >= 0 && place <= 1)
}

/** What is at a place, for people: the nearest design, or the cell; null where there is nothing. */
export function placeInWords(
  model: ParallelModel,
  rows: Uint32Array,
  pair: readonly [number, number],
  at: readonly [number, number],
  { asCells, reach }: { readonly asCells: boolean; readonly reach: number },
): string | null {
  const axes = pair.map((index) => model.axes[index])
  if (asCells) {
    const cells = at.map(cellAt)
    const found = cellsOf(model, rows, ...pair).find(
      ({ column, row }) => column === cells[0] && row === cells[1],
    )
    if (!found) return null
    const [across, up] = axes.map((axis, k) => {
      const from = cells[k]!
      return `${inWords(axis.name)} ${stretchOf(axis, [from / CELLS, (from + 1) / CELLS])}`
    })
    const rank =
      found.bucket === null
        ? 'all failed'
        : `mean rank ${formatNumber(found.bucket + 1, 3)} of ${BUCKETS}`
    return [
      across,
      up,
      found.designs === 1 ? '1 design' : `${formatCount(found.designs)} designs`,
      rank,
    ].join('  ·  ')
  }
  const row = nearestRow(model, rows, pair, at, reach)
  if (row === null) return null
  const values = axes.map((axis) => {
    const value = valueAt(axis, axis.places[row])
    const name = axis.choices[Math.round(value)]
    return `${inWords(axis.name)} ${name === undefined ? exactQuantity(value, axis.unit) : inWords(name)}`
  })
  return [...values, `fitness ${formatNumber(model.fitness[row], 5)}`].join('  ·  ')
}

function cellAt(place: number): number | null {
  return place >= 0 && place <= 1 ? Math.min(CELLS - 1, Math.floor(place * CELLS)) : null
}

function clamped(place: number): number {
  return Math.min(1, Math.max(0, place))
}
