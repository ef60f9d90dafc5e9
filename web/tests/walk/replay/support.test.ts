/** Support polygon, slip and peaks of a walk. */

import { expect, test } from 'vitest'
import { parseReplay } from '../../../src/walk/replay/replay'
import { hull, peakOf, slipPerMetre, slipSpeed } from '../../../src/walk/replay/support'
import { encoded, frames, header } from './replay-bytes'

test('the support polygon is the convex hull of the standing feet', () => {
  const square = [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
  ] as const
  expect(hull([...square, [0.5, 0.5]])).toEqual(square)
  expect(hull([[1, 2]])).toEqual([[1, 2]])
})

test('a foot slips only while it stands', () => {
  const replay = parseReplay(encoded(header(4), frames(4)))
  expect(slipSpeed(replay, 0, 0)).toBe(0)
  // The first frame has no force.
  expect(slipSpeed(replay, 0, 1)).toBe(0)
  const moved = replay.value('foot_position', 3, 0) - replay.value('foot_position', 2, 0)
  expect(slipSpeed(replay, 0, 3)).toBeCloseTo(Math.abs(moved) / 0.1, 4)
})

test('values without a channel or a distance are unknown', () => {
  const replay = parseReplay(encoded(header(2), frames(2)))
  expect(peakOf(replay, 'current', [5])).toBeNull()
  expect(peakOf(replay, 'foot_force', [10, 10, 5])).toEqual({ peak: 10, share: 2 })
  expect(slipPerMetre(parseReplay(encoded(header(1), frames(1))))).toBeNull()
})
