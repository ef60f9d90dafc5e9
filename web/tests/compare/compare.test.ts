import { describe, expect, test } from 'vitest'
import {
  type ComparedJob,
  convergences,
  distributions,
  referencesOf,
} from '../../src/compare/charts'

const job = (changes: Partial<ComparedJob['convergence']>, fitness: number[]): ComparedJob => ({
  id: 'k2q7zr5dm9xw',
  name: '',
  state: 'succeeded',
  best_fitness: 1,
  evaluations: 8,
  failed: 0,
  convergence: {
    id: 'k2q7zr5dm9xw',
    iterations: [0, 1],
    evaluations: [4, 8],
    seconds: [1, 2],
    best_so_far: [3, 2],
    ...changes,
  },
  shares: fitness.map((_, k) => k / (fitness.length - 1)),
  fitness,
})

const short = job({}, [2, 4, 6])
const long = job(
  { iterations: [0, 1, 2], evaluations: [2, 4, 6], seconds: [2, 4, 6], best_so_far: [null, 5, 1] },
  [1, 5],
)

test('each reference is drawn once', () => {
  const reference = { name: 'A', kind: 'published', fitness: 20.93 } as const
  const start = { name: 'start design', kind: 'start', fitness: 40 } as const
  const none = { ...reference, fitness: null }
  const jobs = [
    short,
    { ...short, reference },
    { ...long, reference },
    { ...long, reference: none },
    { ...long, reference: start },
  ]
  expect(referencesOf(jobs)).toEqual([
    { label: 'published A', fitness: 20.93 },
    { label: 'start design', fitness: 40 },
  ])
})

describe('convergence of several jobs', () => {
  test('holds the best value until the next improvement, and ends with the job', () => {
    const { x, lines } = convergences([short, long], 'evaluations')
    expect(x).toEqual([2, 4, 6, 8])
    expect(lines).toEqual([
      [null, 3, 3, 2],
      [null, 5, 1, null],
    ])
  })

  test('numbers iterations from 0', () => {
    expect(convergences([short, long], 'iterations').x).toEqual([0, 1, 2])
  })
})

test('distribution functions rise from 0 to 1 over the fitness values of all jobs', () => {
  const { x, lines } = distributions([short, long])
  expect(x).toEqual([1, 2, 4, 5, 6])
  expect(lines).toEqual([
    [0, 0, 0.5, 0.5, 1],
    [0, 0, 0, 1, 1],
  ])
})
