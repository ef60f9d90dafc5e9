import { describe, expect, test } from 'vitest'
import { nearest, shareOf } from '../../../src/charts/scale'
import { placeNames, scaleOf } from '../../../src/charts/scatter/scatter'

const BOX = { left: 10, top: 20, width: 100, height: 200 }

describe('an axis of a scatter chart', () => {
  test('spans all finite values with a margin', () => {
    const axis = scaleOf([[2, Number.NaN], Float32Array.from([4, 3])], false)
    expect([axis.low, axis.high]).toEqual([1.9, 4.1])
  })

  test('is logarithmic only if all values are positive', () => {
    const axis = scaleOf([[1, 100]], true)
    expect(axis.logarithmic).toBe(true)
    expect(shareOf(axis, 10)).toBeCloseTo(0.5)
    expect(scaleOf([[0, 100]], true).logarithmic).toBe(false)
  })

  test('is defined for one value and for none', () => {
    const one = scaleOf([[5]], false)
    expect(one.low).toBeLessThan(5)
    expect(one.high).toBeGreaterThan(5)
    expect(scaleOf([[Number.NaN]], true)).toMatchObject({ low: 0, high: 1 })
  })
})

test('a click chooses the nearest point within reach', () => {
  const places = [
    [5, 0, 0],
    [6, 10, 0],
  ] as const
  expect(nearest(places, [7, 0], 24)).toBe(6)
  expect(nearest(places, [40, 0], 24)).toBeNull()
  expect(nearest([[0, Number.NaN, 0]], [0, 0], 24)).toBeNull()
})

describe('labels of points', () => {
  const named = (x: number, y: number) => ({ at: [x, y] as const, width: 30 })

  test('are next to their point, on the other side at the edge of the box', () => {
    const [inner, edge] = placeNames([named(20, 100), named(100, 100)], BOX, 10, 5)
    expect(inner).toEqual([25, 100])
    expect(edge).toEqual([65, 100])
  })

  test('do not overlap', () => {
    const [first, second] = placeNames([named(50, 100), named(50, 100)], BOX, 10, 5)
    expect(first).toEqual([55, 100])
    expect(second).toEqual([15, 100])
  })

  test('are omitted if there is no space', () => {
    const crowd = Array.from({ length: 30 }, () => named(50, 100))
    expect(placeNames(crowd, BOX, 10, 5)).toContain(null)
  })
})
