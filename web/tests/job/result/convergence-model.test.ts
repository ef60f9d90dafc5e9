import { describe, expect, test } from 'vitest'
import type { Particles } from '../../../src/job/designs/particles'
import { dotsOf, fittedRange, iterationsAbove } from '../../../src/job/result/model'

const column = (name: string, values: readonly number[]) => ({
  name,
  unit: '1',
  low: null,
  high: null,
  kind: 'measure',
  choices: [],
  values: Float32Array.from(values),
})

describe('the range of the convergence chart', () => {
  test('fits best, median and reference only', () => {
    const [low, high] = fittedRange(
      [
        [20, 15, 10],
        [40, 30, null],
      ],
      [17],
      false,
    )!
    expect([low < 10, low > 8, high > 40, high < 42]).toEqual([true, true, true, true])
    expect(fittedRange([[20], [40]], [90], false)![1]).toBeGreaterThan(90)
  })

  test('has positive ends if logarithmic, and is null without a number', () => {
    const [low, high] = fittedRange([[0, 10], [1000]], [], true)!
    expect([low > 7, low < 10, high > 1000]).toEqual([true, true, true])
    expect(fittedRange([[null], []], [17], true)).toBeNull()
    expect(fittedRange([[5], [5]], [], false)![1]).toBeGreaterThan(5)
  })
})

describe('values above the range', () => {
  const particles: Particles = {
    rows: 4,
    total: 400,
    columns: [column('iteration', [0, 0, 1, 2]), column('fitness', [5, 99, Number.NaN, 7])],
  }

  test('include only successful designs, possibly thinned', () => {
    const dots = dotsOf(particles)!
    expect([...dots.iterations]).toEqual([0, 0, 2])
    expect([...dots.fitness]).toEqual([5, 99, 7])
    expect(dots.total).toBe(400)
    expect(dotsOf({ ...particles, columns: [] })).toBeNull()
  })

  test('are marked once per iteration, for bands and single designs', () => {
    const dots = dotsOf(particles)
    expect([...iterationsAbove([1, 50], [0, 1, 2], null, dots)]).toEqual([0])
    expect([...iterationsAbove([1, 50], [0, 1, 2], [10, 60, null], null)]).toEqual([1])
    expect([...iterationsAbove(null, [0], [60], dots)]).toEqual([])
  })
})
