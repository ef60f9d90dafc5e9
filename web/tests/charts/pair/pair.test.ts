import { describe, expect, test } from 'vitest'
import {
  axisTicks,
  CELLS,
  cellsOf,
  dragged,
  nearestRow,
  placeInWords,
} from '../../../src/charts/pair/pair-model'
import { buildModel, selectRows } from '../../../src/charts/parallel/parallel-model'

const source = (name: string, values: number[]) => ({
  name,
  unit: '1',
  low: 0,
  high: 10,
  logarithmic: false,
  choices: [],
  values: Float32Array.from(values),
})

// Two designs in one corner, one in the opposite corner, and a failed one.
const model = buildModel(
  [source('a', [0, 0.1, 10, 5]), source('b', [0, 0.1, 10, 5])],
  Float32Array.from([1, 2, 3, Number.NaN]),
)
const all = selectRows(model, new Map())

describe('two axes', () => {
  test('are divided into cells with the mean rank of their designs', () => {
    const cells = cellsOf(model, all, 0, 1)
    expect(cells).toHaveLength(3)
    const at = (cell: number) => cells.find(({ column, row }) => column === cell && row === cell)!
    expect(at(0)).toMatchObject({ designs: 2 })
    expect(at(0).bucket!).toBeLessThan(at(CELLS - 1).bucket!)
    expect(at(CELLS / 2).bucket).toBeNull()
  })

  test('have ticks at round numbers, or at the names of choices', () => {
    expect(axisTicks(model.axes[0]).map(([, text]) => text)).toEqual([
      '0',
      '2',
      '4',
      '6',
      '8',
      '10',
    ])
    const laws = { ...model.axes[0], high: 1, choices: ['dead_zone', 'stick'] }
    expect(axisTicks(laws)).toEqual([
      [0, 'dead zone'],
      [1, 'stick'],
    ])
    const decades = { ...model.axes[0], low: 3, high: 300, logarithmic: true }
    expect(axisTicks(decades).every(([place]) => place >= 0 && place <= 1)).toBe(true)
  })

  test('describe the nearest design or the cell at a position', () => {
    const at = (place: number, asCells: boolean) =>
      placeInWords(model, all, [0, 1], [place, place], { asCells, reach: 0.05 })
    expect(at(1, false)).toBe('a 10  ·  b 10  ·  fitness 3.0000')
    expect(at(0.3, false)).toBeNull()
    expect(at(0, true)).toContain('2 designs  ·  mean rank')
    expect(at(0.5, true)).toContain('all failed')
  })

  test('a drag in any direction selects the box between its ends', () => {
    expect(dragged([0.8, 0.2], [0.5, 0.6])).toEqual([
      [0.5, 0.8],
      [0.2, 0.6],
    ])
    expect(dragged([-1, 0.5], [0.5, 2])).toEqual([
      [0, 0.5],
      [0.5, 1],
    ])
  })

  test('the nearest design within reach is chosen', () => {
    expect(nearestRow(model, all, [0, 1], [0.98, 0.98], 0.1)).toBe(2)
    expect(nearestRow(model, all, [0, 1], [0.75, 0.2], 0.1)).toBeNull()
  })
})
