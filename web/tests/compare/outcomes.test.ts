import { describe, expect, test } from 'vitest'
import type { Job } from '../../src/api/types'
import { bestOf, outcomeOf, sharedScenarios } from '../../src/compare/outcomes'
import { specWords } from '../../src/compare/spec-words'

const job = (scenarios: Record<string, Record<string, number | null>>) => ({
  best: {
    scenarios: Object.fromEntries(
      Object.entries(scenarios).map(([name, objectives]) => [name, { objectives }]),
    ),
  } as unknown as Job['best'],
})

const both = job({
  flat: { energy: 10, reciprocal_speed: 10 },
  steep: { energy: 30, reciprocal_speed: 20 },
})
const flat = job({ flat: { energy: 12, reciprocal_speed: null } })

describe('outcomes of jobs', () => {
  test('are compared in shared scenarios', () => {
    expect(sharedScenarios([both, flat])).toEqual(['flat'])
    expect(sharedScenarios([both, { best: null }])).toEqual(['flat', 'steep'])
    expect(sharedScenarios([])).toEqual([])
  })

  test('are means over scenarios, with the speed in place of its reciprocal', () => {
    expect(outcomeOf(both, { name: 'energy' }, ['flat', 'steep'])).toBe(20)
    expect(outcomeOf(both, { name: 'speed' }, ['flat', 'steep'])).toBeCloseTo(0.075)
    expect(outcomeOf(flat, { name: 'speed' }, ['flat'])).toBeNull()
    expect(outcomeOf({ best: null }, { name: 'energy' }, ['flat'])).toBeNull()
  })

  test('have a best value, the greatest of the speed', () => {
    expect(bestOf([2, null, 1], false)).toBe(1)
    expect(bestOf([2, null, 1], true)).toBe(2)
    expect(bestOf([null], false)).toBeNull()
  })
})

test.each([
  ['"pso"', 'pso'],
  ['[0.9, 0.8]', '0.9, 0.8'],
  ['{"cycle_time": 1.5, "robust": false}', 'cycle time 1.5, robust no'],
  ['from 0 to 10', 'from 0 to 10'],
  [null, '–'],
])('the value %s of a spec is %s', (json, words) => {
  expect(specWords(json)).toBe(words)
})
