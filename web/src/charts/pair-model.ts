/** Two axes of parallel coordinates set against each other: points, cells, what a drag selects. Pure. */

import { type Brush, FAILED, type ParallelModel } from './parallel-model'

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

function cellAt(place: number): number | null {
  return place >= 0 && place <= 1 ? Math.min(CELLS - 1, Math.floor(place * CELLS)) : null
}

function clamped(place: number): number {
  return Math.min(1, Math.max(0, place))
}
