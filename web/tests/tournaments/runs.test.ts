import { expect, test } from 'vitest'
import type { ProblemRuns } from '../../src/api/types'
import { cloud, convergence } from '../../src/tournaments/runs'

const FOUND: ProblemRuns = {
  problem: 'D7C0R0I1',
  dimension: 7,
  target: 0.001,
  checkpoints: [1, 10],
  methods: {
    pso: {
      lower: [4, 0],
      median: [5, 0.5],
      upper: [null, 0.7],
      best: [0.5, 0, null],
      found_after: [9, 4, null],
      solved_after: [null, 4, null],
    },
    random: {
      lower: [4, 1],
      median: [5, 2],
      upper: [6, 3],
      best: [2],
      found_after: [7],
      solved_after: [null],
    },
  },
}

const METHODS = [
  { label: 'pso', job: 'p', colour: '--series-1' },
  { label: 'random', job: 'r', colour: null },
  { label: 'late', job: 'l', colour: '--series-2' },
] as const

test('a method in colour has a band between its quartiles, any other its median alone', () => {
  const { x, series, bands } = convergence(FOUND, METHODS)
  expect(x).toEqual([1, 10])
  expect(series.map(({ label, silent }) => [label, silent ?? false])).toEqual([
    ['target', false],
    ['pso, quartile', true],
    ['pso, quartile', true],
    ['pso', false],
    ['random', true],
  ])
  expect(bands.map(({ upper, lower }) => [series[upper].values, series[lower].values])).toEqual([
    [
      [null, 0.7],
      [4, 1e-9],
    ],
  ])
})

test('every run that found something is a point, in the order of evaluations', () => {
  const { x, series } = cloud(FOUND, METHODS)
  expect(x).toEqual([1, 4, 7, 9, 10])
  expect(series.map(({ label, values }) => [label, values])).toEqual([
    ['target', Array(5).fill(0.001)],
    ['random', [null, null, 2, null, null]],
    ['pso', [null, 1e-9, null, 0.5, null]],
  ])
})

test('without a target there is no line of acceptance', () => {
  const labels = convergence({ ...FOUND, target: null }, METHODS).series.map(({ label }) => label)
  expect(labels).not.toContain('target')
})
