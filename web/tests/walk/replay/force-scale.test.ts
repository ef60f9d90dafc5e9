import { expect, test } from 'vitest'
import { newtonsPerCell, typicalLargest } from '../../../src/walk/replay/force-scale'

const HEXAPOD = { span: 0.53, width: 0.5, height: 0.2, cell: 0.1 }

test.each([
  [0, 10],
  [20, 10],
  [48, 20],
  [60, 50],
  [0.02, 0.01],
])('forces up to %d N are drawn with a cell for %d N', (largest, expected) => {
  expect(newtonsPerCell(largest, HEXAPOD)).toBeCloseTo(expected)
})

test('a rare impact does not determine the scale', () => {
  const norms = new Float32Array(1000).fill(20)
  norms[500] = 900
  expect(typicalLargest(norms)).toBe(20)
})
