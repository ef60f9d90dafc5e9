import { describe, expect, test } from 'vitest'
import { buildModel } from '../../src/charts/parallel/parallel-model'
import { brushesOf, brushWords } from '../../src/job/designs/particles'
import { flag, ORDER, oneOf, RANGE } from '../../src/router/query-value'

describe('a query value', () => {
  test('of a choice is one of its words, omitted for the default', () => {
    const layer = oneOf(['inference', 'table'], 'inference')
    expect(layer.read('table')).toBe('table')
    expect(layer.read('toString')).toBeUndefined()
    expect(layer.write('inference')).toBeNull()
    expect(layer.write('table')).toBe('table')
  })

  test('of a range is two increasing numbers', () => {
    expect(RANGE.read('2:40.5')).toEqual([2, 40.5])
    for (const wrong of ['', '2', '2:', ':3', '40:2', '1:2:3', 'a:b', '1:Infinity']) {
      expect(RANGE.read(wrong)).toBeUndefined()
    }
    expect(RANGE.write([1 / 3, 2])).toBe('0.33333:2')
    expect(RANGE.write(null)).toBeNull()
  })

  test('of an order is a column and a direction', () => {
    const order = { column: 'best_so_far', descending: true }
    expect(ORDER.read(ORDER.write(order)!)).toEqual(order)
    expect(ORDER.read('name')).toEqual({ column: 'name', descending: false })
    expect(ORDER.read('<x>')).toBeUndefined()
  })

  test('is omitted for the default', () => {
    expect(flag(true).write(true)).toBeNull()
    expect(flag(true).read(flag(true).write(false)!)).toBe(false)
    expect(flag(true).read('perhaps')).toBeUndefined()
  })
})

describe('a selection in an address', () => {
  const source = { unit: '1', choices: [], values: new Float32Array([1, 3]) }
  const linear = { ...source, name: 'FI1R', low: 0, high: 10, logarithmic: false }
  const named = { ...source, name: 'a:b', low: 1, high: 100, logarithmic: true }
  const { axes } = buildModel([linear, named], new Float32Array([1, 2]))

  test('is restored exactly, also for names with colons and logarithmic axes', () => {
    const words = brushWords(
      axes,
      new Map([
        [0, [0.2, 0.5]],
        [1, [0, 0.5]],
      ] as const),
    )
    expect(words).toBe('FI1R:2:5,a:b:1:10')
    const { brushes, unknown } = brushesOf(axes, words)
    expect([...brushes]).toEqual([
      [0, [0.2, 0.5]],
      [1, [0, 0.5]],
    ])
    expect(unknown).toEqual([])
    expect(brushWords(axes, new Map())).toBeNull()
  })

  test('skips unknown axes and invalid ranges', () => {
    const { brushes, unknown } = brushesOf(axes, 'none:1:2,FI1R:5:2,FI1R,FI1R:1:')
    expect(brushes.size).toBe(0)
    expect(unknown).toHaveLength(4)
    expect(brushesOf(axes, null).unknown).toEqual([])
  })
})
