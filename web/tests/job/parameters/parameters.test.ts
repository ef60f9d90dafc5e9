import { expect, test } from 'vitest'
import type { FittedParameter, Identifiability, Job, JobSummary } from '../../../src/api/types'
import {
  isCategorical,
  outline,
  placeOf,
  rankOf,
  shareOf,
  verdicts,
  widthAt,
} from '../../../src/job/parameters/intervals'
import { furtherRuns, labelsOf, repeatedSeeds, runsOf } from '../../../src/job/parameters/runs'

const voltage: FittedParameter = {
  name: 'battery_voltage',
  unit: 'V',
  low: 8,
  high: 12,
  best: 11,
  bests: [11, 10.9],
  intervals: [
    { low: 8, high: 12 },
    { low: 10, high: 11 },
    { low: 10.8, high: 11 },
  ],
  choices: [],
  trust: 'trusted',
  explanation: 'all runs agree on a small part of the range',
}
const mass: FittedParameter = { ...voltage, name: 'body_mass', trust: 'unknown', explanation: 'no' }
const identifiability: Identifiability = {
  jobs: ['a', 'b'],
  fitness: [0.03, 0.031],
  thresholds: [1, 0.1, 0.01],
  designs: [100, 50, 20],
  parameters: [voltage, mass],
}

test('a width is a share of the search range', () => {
  expect(widthAt(identifiability, voltage, 0.1)).toBeCloseTo(0.25)
  expect(widthAt(identifiability, voltage, 0.01)).toBeCloseTo(0.05)
})

test('an unknown threshold has no width', () => {
  expect(widthAt(identifiability, voltage, 0.05)).toBeNull()
})

test('categorical parameters have no widths', () => {
  const choices = ['karnopp', 'stick'].map((name) => ({
    name,
    fitness: 1,
    by_run: [1, 1],
    remains: true,
  }))
  const law: FittedParameter = { ...voltage, name: 'contact_law', low: 0, high: 1, choices }
  expect([voltage, law].map(isCategorical)).toEqual([false, true])
  expect(widthAt(identifiability, law, 0.1)).toBeNull()
})

test('verdicts are counted from best to worst, with explanations', () => {
  expect(verdicts(identifiability)).toEqual([
    { trust: 'trusted', count: 1, explanation: 'all runs agree on a small part of the range' },
    { trust: 'rough', count: 0, explanation: null },
    { trust: 'unknown', count: 1, explanation: 'no' },
  ])
})

test('a parameter of a single run has no rank, so that it comes last', () => {
  expect([voltage, mass].map(rankOf)).toEqual([0, 2])
  expect(rankOf({ ...voltage, trust: null })).toBeNull()
})

test('thresholds are spaced logarithmically, the smallest at the left', () => {
  expect(placeOf(0.01, identifiability.thresholds)).toBe(0)
  expect(placeOf(0.1, identifiability.thresholds)).toBeCloseTo(0.5)
  expect(placeOf(1, identifiability.thresholds)).toBeCloseTo(1)
})

test('an outline follows the upper ends and returns along the lower ones', () => {
  expect(shareOf(10, voltage)).toBe(0.5)
  expect(outline(identifiability, voltage, 100, 40)).toBe(
    'M100.0 0.0L50.0 10.0L0.0 10.0L0.0 12.0L50.0 20.0L100.0 40.0Z',
  )
})

test('an address names each further run once, without the job itself', () => {
  const query = new URLSearchParams('also=b,,c, b,a')
  expect(runsOf(query, 'a')).toEqual(['b', 'c'])
  expect(runsOf(new URLSearchParams(), 'a')).toEqual([])
})

test('runs beyond the limit of the API are ignored', () => {
  const ids = Array.from({ length: 40 }, (_, k) => `job${k}`)
  expect(runsOf(new URLSearchParams({ also: ids.join() }), 'a')).toHaveLength(31)
})

function summary(change: Partial<JobSummary>): JobSummary {
  const scenarios = ['r1', 'r2']
  return { id: 'x', kind: 'identification', scenarios, best_fitness: 0.03, ...change } as JobSummary
}

test('only fits of the same recordings with a result are offered as further runs', () => {
  const jobs = [
    summary({ id: 'a' }),
    summary({ id: 'b', scenarios: ['r2', 'r1'] }),
    summary({ id: 'c', scenarios: ['r1'] }),
    summary({ id: 'd', best_fitness: null }),
    summary({ id: 'e', kind: 'tuning' }),
  ]
  expect(furtherRuns(jobs, jobs[0]).map(({ id }) => id)).toEqual(['b'])
})

test('calibrations are compared with calibrations', () => {
  const jobs = ['a', 'b'].map((id) => summary({ id, kind: 'calibration' }))
  const same = furtherRuns([...jobs, summary({ id: 'c' })], jobs[0])
  expect(same.map(({ id }) => id)).toEqual(['b'])
})

function job(id: string, seed: number): Job {
  return { id, spec: { seed } } as Job
}

test('runs are labelled by their seeds if distinct, otherwise by their ids', () => {
  expect(labelsOf(['a', 'b'], [job('b', 2), job('a', 1)])).toEqual(['seed 1', 'seed 2'])
  expect(labelsOf(['a', 'b'], [job('a', 1), job('b', 1)])).toEqual(['a', 'b'])
  expect(labelsOf(['a', 'b'], [job('a', 1)])).toEqual(['a', 'b'])
})

test('repeated seeds are reported', () => {
  expect(repeatedSeeds([job('a', 1), job('b', 2), job('c', 1)])).toEqual([1])
  expect(repeatedSeeds([job('a', 1), job('b', 2)])).toEqual([])
})
