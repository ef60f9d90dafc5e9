import { describe, expect, test } from 'vitest'
import { CELLS, cellsOf, dragged, nearestRow } from '../src/charts/pair-model'
import { buildModel, selectRows } from '../src/charts/parallel-model'

const source = (name: string, values: number[]) => ({
  name,
  unit: '1',
  low: 0,
  high: 10,
  logarithmic: false,
  choices: [],
  values: Float32Array.from(values),
})

// Two designs in one corner, one in the other, one that fails.
const model = buildModel(
  [source('a', [0, 0.1, 10, 5]), source('b', [0, 0.1, 10, 5])],
  Float32Array.from([1, 2, 3, Number.NaN]),
)
const all = selectRows(model, new Map())

describe('two axes', () => {
  test('are cut into cells with the mean rank of their designs', () => {
    const cells = cellsOf(model, all, 0, 1)
    expect(cells).toHaveLength(3)
    const at = (cell: number) => cells.find(({ column, row }) => column === cell && row === cell)!
    expect(at(0)).toMatchObject({ designs: 2 })
    expect(at(0).bucket!).toBeLessThan(at(CELLS - 1).bucket!)
    expect(at(CELLS / 2).bucket).toBeNull()
  })

  test('have a drag select the box between its ends, whatever its direction', () => {
    expect(dragged([0.8, 0.2], [0.5, 0.6])).toEqual([
      [0.5, 0.8],
      [0.2, 0.6],
    ])
    expect(dragged([-1, 0.5], [0.5, 2])).toEqual([
      [0, 0.5],
      [0.5, 1],
    ])
  })

  test('have the nearest design chosen, if it is near enough', () => {
    expect(nearestRow(model, all, [0, 1], [0.98, 0.98], 0.1)).toBe(2)
    expect(nearestRow(model, all, [0, 1], [0.75, 0.2], 0.1)).toBeNull()
  })
})
