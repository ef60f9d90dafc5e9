import { expect, test } from 'vitest'
import type { TargetResult } from '../../../src/api/types'
import { isWithin, leaveOutOf, withinCount } from '../../../src/job/targets/targets'

function target(use: string, difference: number | null): TargetResult {
  return {
    walk: 'pi',
    relative_to: null,
    quantity: 'energy',
    unit: 'J/m',
    value: 42,
    tolerance: 0.2,
    use,
    simulated: null,
    difference,
    left_out: null,
  }
}

test('a target is met within one tolerance on either side', () => {
  expect([-1.1, -1, 0, 1, 1.1].map(isWithin)).toEqual([false, true, true, true, false])
  expect(isWithin(null)).toBe(false)
})

test('only fitted targets are counted', () => {
  const targets = [target('fit', 0.5), target('fit', -2), target('fit', null), target('predict', 0)]
  expect(withinCount({ targets })).toEqual({ within: 1, fitted: 3 })
})

test('an address can leave out a target or a walk', () => {
  const words = ['leave_out=target', 'leave_out=walk', 'leave_out=all', '']
  expect(words.map((text) => leaveOutOf(new URLSearchParams(text)))).toEqual([
    'target',
    'walk',
    null,
    null,
  ])
})
