import { expect, test } from 'vitest'
import { isolinesOf } from '../../../src/charts/pair/isolines'
import { CELLS } from '../../../src/charts/pair/pair-model'

/** One cell per value; null for cells in which all designs failed. */
function cellsFrom(rows: readonly (readonly (number | null)[])[]) {
  return rows.flatMap((values, row) =>
    values.map((bucket, column) => ({ column, row, designs: 1, bucket })),
  )
}

const middle = (at: number) => (at + 0.5) / CELLS

test('an isoline is interpolated between the centres of cells', () => {
  const slope = cellsFrom([
    [0, 4, 8],
    [0, 4, 8],
  ])
  const [line, ...others] = isolinesOf(slope, [1, 20])
  expect(others).toEqual([])
  expect(line.level).toBe(1)
  expect(line.pieces).toHaveLength(1)
  for (const [x] of line.pieces[0]) expect(x).toBeCloseTo(middle(0.25))
  expect(line.pieces[0].map(([, y]) => y).toSorted()).toEqual([middle(0), middle(1)])
})

test('there is no isoline next to cells without a mean, nor across the edges of the grid', () => {
  const hole = cellsFrom([
    [0, 4],
    [0, null],
  ])
  expect(isolinesOf(hole, [2])).toEqual([])
  const ends = [
    { column: CELLS - 1, row: 0, designs: 1, bucket: 0 },
    { column: 0, row: 1, designs: 1, bucket: 9 },
    { column: CELLS - 1, row: 1, designs: 1, bucket: 0 },
    { column: 0, row: 2, designs: 1, bucket: 9 },
  ]
  expect(isolinesOf(ends, [5])).toEqual([])
})

test('a saddle has two segments, around the corners that its mean separates', () => {
  const saddle = (level: number) =>
    isolinesOf(
      cellsFrom([
        [4, 0],
        [0, 4],
      ]),
      [level],
    )[0].pieces
  // With a low mean, each segment surrounds a high corner; otherwise a low one.
  const nearest = (level: number) =>
    saddle(level).map((piece) => {
      const [x, y] = [0, 1].map((k) => (piece[0][k] + piece[1][k]) / 2)
      return Math.sign((x - middle(0.5)) * (y - middle(0.5)))
    })
  expect(nearest(3)).toEqual([1, 1])
  expect(nearest(1)).toEqual([-1, -1])
})
