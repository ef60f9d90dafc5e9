import { describe, expect, test } from 'vitest'
import {
  bestRows,
  buildModel,
  FAILED,
  marksOf,
  selectRows,
  stretchOf,
} from '../../src/charts/parallel/parallel-model'
import { linearTicks, logRange, logTicks, shareOf, valueAt } from '../../src/charts/scale'
import { decodeParticles } from '../../src/job/designs/particles'

describe('a logarithmic axis', () => {
  test('has round numbers within a decade', () => {
    expect(logTicks(9.9, 54)).toEqual([10, 20, 30, 40, 50])
  })

  test('has powers of ten over many decades', () => {
    expect(logTicks(1, 1e6)).toEqual([1, 10, 100, 1000, 10000, 100000, 1000000])
  })

  test('has a range for equal values and for no values', () => {
    const [low, high] = logRange(5, 5)
    expect(low).toBeLessThan(5)
    expect(high).toBeGreaterThan(5)
    expect(logRange(null, null)).toEqual([1, 10])
  })

  test('ticks have no rounding errors', () => {
    expect(linearTicks(0, 0.6)).toEqual([0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
  })
})

describe('parallel coordinates', () => {
  const fitness = Float32Array.from([3, 1, Number.NaN, 2])
  const model = buildModel(
    [
      {
        name: 'P',
        unit: '1',
        low: 0,
        high: 10,
        logarithmic: false,
        choices: [],
        values: Float32Array.from([0, 5, 10, 7.5]),
      },
      {
        name: 'fitness',
        unit: '1',
        low: null,
        high: null,
        logarithmic: true,
        choices: [],
        values: fitness,
      },
      {
        name: 'contact_law',
        unit: '1',
        low: 0,
        high: 2,
        logarithmic: false,
        choices: ['linear_zone', 'karnopp', 'stick'],
        values: Float32Array.from([0, 2, 1, 0]),
      },
    ],
    fitness,
  )

  test('place values between the bounds, or between minimum and maximum', () => {
    expect([...model.axes[0].places]).toEqual([0, 0.5, 1, 0.75])
    expect(model.axes[1]).toMatchObject({ low: 1, high: 3 })
    expect(model.axes[1].places[2]).toBeNaN()
  })

  test('valueAt inverts shareOf', () => {
    expect(valueAt(model.axes[1], shareOf(model.axes[1], 2))).toBeCloseTo(2, 12)
  })

  test('label an axis with its bounds or its choices', () => {
    expect(marksOf(model.axes[0])).toEqual([0, 10])
    expect(marksOf(model.axes[2])).toEqual(['linear_zone', 'karnopp', 'stick'])
    expect([...model.axes[2].places]).toEqual([0, 1, 0.5, 0])
  })

  test('describe the selected range or choices', () => {
    expect(stretchOf(model.axes[0], [0.2, 0.5])).toBe('2 to 5')
    expect(stretchOf(model.axes[2], [0, 0.6])).toBe('linear zone, karnopp')
    expect(stretchOf(model.axes[2], [0.6, 0.9])).toBe('none')
  })

  test('order every row exactly once', () => {
    const many = buildModel([], new Float32Array(1000))
    expect(new Set(many.order).size).toBe(1000)
  })

  test('select the rows inside all brushes', () => {
    expect([...selectRows(model, new Map([[0, [0.4, 0.8]]]))].sort()).toEqual([1, 3])
    const both = new Map([
      [0, [0.4, 0.8] as const],
      [1, [0, 0.3] as const],
    ])
    expect([...selectRows(model, both)]).toEqual([1])
  })

  test('a brush on fitness excludes failed designs', () => {
    expect([...selectRows(model, new Map([[1, [0, 1]]]))].sort()).toEqual([0, 1, 3])
  })

  test('return the best of the selected rows', () => {
    expect(bestRows(model, model.order, 2)).toEqual([1, 3])
  })

  test('colour by rank, with a separate colour for failed designs', () => {
    expect(model.buckets[2]).toBe(FAILED)
    expect(model.buckets[1]).toBeLessThan(model.buckets[3])
    expect(model.buckets[3]).toBeLessThan(model.buckets[0])
  })
})

test('particles are decoded from the API format', () => {
  const columns = ['iteration', 'fitness'].map((name) => ({
    name,
    unit: '1',
    low: null,
    high: null,
    kind: 'index',
  }))
  let header = JSON.stringify({ rows: 3, total: 9, columns })
  header += ' '.repeat((4 - (header.length % 4)) % 4)
  const buffer = new ArrayBuffer(4 + header.length + 2 * 3 * 4)
  new DataView(buffer).setUint32(0, header.length, true)
  new Uint8Array(buffer).set(new TextEncoder().encode(header), 4)
  new Float32Array(buffer, 4 + header.length).set([0, 0, 1, 21.5, Number.NaN, 20.25])
  const particles = decodeParticles(buffer)
  expect(particles).toMatchObject({ rows: 3, total: 9 })
  expect([...particles.columns[0].values]).toEqual([0, 0, 1])
  expect([...particles.columns[1].values]).toEqual([21.5, Number.NaN, 20.25])
})
