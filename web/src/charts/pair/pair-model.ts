/** Two axes of parallel coordinates: points, cells and drag selection. */

import { exactQuantity, formatCount, formatNumber } from '../../format/number'
import { inWords } from '../../format/words'
import {
  type Axis,
  type Brush,
  BUCKETS,
  FAILED,
  type ParallelModel,
  stretchOf,
} from '../parallel/parallel-model'
import { nearest, shareOf, type Tick, ticksOf, valueAt } from '../scale'

/** Rows considered; the first of the shuffled order, a fair sample. */
export const SAMPLE = 4000

export const CELLS = 14

export interface Cell {
  /** Counted from the lower left, from 0. */
  readonly column: number
  readonly row: number
  readonly designs: number
  /** Mean bucket of the designs with a fitness; null if there are none. */
  readonly bucket: number | null
}

export function sampleOf(rows: Uint32Array): Uint32Array {
  return rows.subarray(0, SAMPLE)
}

/** Non-empty cells with their mean rank. */
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

export function dragged(
  from: readonly [number, number],
  to: readonly [number, number],
): readonly [Brush, Brush] {
  const clamped = (place: number) => Math.min(1, Math.max(0, place))
  const stretch = (k: 0 | 1): Brush => {
    const [a, b] = [clamped(from[k]), clamped(to[k])]
    return a < b ? [a, b] : [b, a]
  }
  return [stretch(0), stretch(1)]
}

/** The sampled row nearest to a position, within reach; null if there is none. */
export function nearestRow(
  model: ParallelModel,
  rows: Uint32Array,
  [x, y]: readonly [number, number],
  at: readonly [number, number],
  reach: number,
): number | null {
  const [xs, ys] = [model.axes[x].places, model.axes[y].places]
  const points = Array.from(sampleOf(rows), (row) => [row, xs[row], ys[row]] as const)
  return nearest(points, at, reach)
}

/** Ticks of an axis: round numbers, or the names of choices. */
export function axisTicks(axis: Axis): Tick[] {
  if (axis.choices.length === 0) return ticksOf(axis, 5)
  return axis.choices.map((name, k) => [shareOf(axis, k), inWords(name)])
}

/** Description of the nearest design or the cell at a position; null if there is none. */
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
    const cell = cellsOf(model, rows, ...pair).find(
      ({ column, row }) => column === cells[0] && row === cells[1],
    )
    if (!cell) return null
    const [across, up] = axes.map((axis, k) => {
      const from = cells[k]!
      return `${inWords(axis.name)} ${stretchOf(axis, [from / CELLS, (from + 1) / CELLS])}`
    })
    const rank =
      cell.bucket === null
        ? 'all failed'
        : `mean rank ${formatNumber(cell.bucket + 1, 3)} of ${BUCKETS}`
    const designs = cell.designs === 1 ? '1 design' : `${formatCount(cell.designs)} designs`
    return [across, up, designs, rank].join('  ·  ')
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
