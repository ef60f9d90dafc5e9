import { expect, test } from 'vitest'
import { type Particles, selectedRows } from '../../../src/job/designs/particles'

const column = (name: string, kind: string, values: readonly number[]) => ({
  name,
  unit: '1',
  low: kind === 'continuous' ? 0 : null,
  high: kind === 'continuous' ? 10 : null,
  kind,
  choices: [],
  values: Float32Array.from(values),
})

const designs: Particles = {
  rows: 3,
  total: 3,
  columns: [
    column('P', 'continuous', [1, 5, 9]),
    column('objective:energy', 'objective', [10, 20, 30]),
    column('fitness', 'fitness', [3, 2, 1]),
  ],
}

test('a selection in the address means the same designs in every tab', () => {
  const rows = (words: string | null) => {
    const selected = selectedRows(designs, words)
    return selected && [...selected].sort()
  }
  expect(rows('P:4:10')).toEqual([1, 2])
  expect(rows('P:4:10,energy:15:25')).toEqual([1])
  // Invalid ranges select nothing.
  expect(rows('none:1:2')).toBeNull()
  expect(rows(null)).toBeNull()
})
