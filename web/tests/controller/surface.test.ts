import { describe, expect, test } from 'vitest'
import {
  cells,
  extent,
  firstCell,
  layersOf,
  moved,
  nearest,
  type Output,
  type Rule,
  ruleText,
  type SurfaceView,
  strength,
} from '../../src/controller/surface'

const output = {
  name: 'FO',
  unit: 'PWM counts',
  range: [-10, 10],
  values: [-10, 0, 10],
  memberships: [],
  rules: [],
  inference: [
    [-8, -2],
    [0, 0],
    [8, 2],
  ],
  table: [
    [-8.5, -2],
    [0, 0],
    [8.25, 2],
  ],
  quantisation: {
    error_bits: 10,
    current_bits: 6,
    velocity_bits: null,
    output_bits: 8,
    bytes: 65536,
    largest_difference: 0.5,
    rms_difference: 0.2,
  },
} satisfies Output

const surface = {
  controller: 'fuzzy-pi',
  velocity_error: null,
  outputs: [output],
  inputs: [
    {
      name: 'error',
      unit: 'counts',
      range: [-100, 100],
      values: [-100, 0, 100],
      memberships: [{ name: 'positive', degrees: [0, 0, 1] }],
    },
    {
      name: 'current',
      unit: 'counts',
      range: [0, 50],
      values: [0, 50],
      memberships: [{ name: 'large', degrees: [0, 0.4] }],
    },
  ],
} satisfies SurfaceView

const [inference, table, difference] = layersOf(surface, output)

/** Parsed from JSON, because code must not contain objects with a `then`. */
function ruleOf(json: string): Rule {
  return JSON.parse(json) as Rule
}

describe('layers', () => {
  test('inference and table share a colour scale; the difference has its own', () => {
    expect([inference.limit, table.limit, difference.limit]).toEqual([8.5, 8.5, 0.5])
  })

  test('the difference is table minus inference', () => {
    expect(difference.values).toEqual([
      [-0.5, 0],
      [0, 0],
      [0.25, 0],
    ])
  })

  test('have a minimum, a maximum and a number of values', () => {
    expect(extent(inference.values)).toEqual([-8, 8])
    expect(cells(inference.values)).toBe(6)
  })
})

describe('rules', () => {
  const rule = ruleOf(
    '{"if": {"error": "positive", "current": "large"}, "then": "negative-extreme", "weight": 0.5}',
  )

  test('the strength is the smallest degree times the weight', () => {
    expect(strength(rule, surface, { error: 2, current: 1 })).toBeCloseTo(0.2)
    expect(strength(rule, surface, { error: 2, current: 0 })).toBe(0)
  })

  test('a rule without a condition on an input does not depend on it', () => {
    const alone = ruleOf('{"if": {"error": "positive"}, "then": "positive", "weight": 0.9}')
    expect(strength(alone, surface, { error: 2, current: 0 })).toBeCloseTo(0.9)
  })

  test('are written as sentences', () => {
    expect(ruleText(rule, 'FO')).toBe(
      'If error is positive and current is large, then FO is negative-extreme',
    )
  })
})

test('the selected point stays within the grid', () => {
  const cell = firstCell(inference)
  expect(moved(cell, 99, 99, inference)).toEqual({ error: 2, current: 1 })
  expect(moved(cell, -99, -99, inference)).toEqual({ error: 0, current: 0 })
})

test.each([
  [-40, 1],
  [-60, 0],
  [1e9, 2],
])('the value nearest to %d has index %d', (value, index) => {
  expect(nearest([-100, 0, 100], value)).toBe(index)
})
