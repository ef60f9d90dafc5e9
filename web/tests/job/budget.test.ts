/** Budgets of jobs, in evaluations. */

import { expect, test } from 'vitest'
import type { Iteration } from '../../src/api/types'
import { budgetSpent, progressInWords, spentInWords } from '../../src/job/facts'

const job = (iterations: number, evaluations: number) => ({
  iterations,
  evaluations,
  evaluations_planned: 100,
})

const followed = (...designs: readonly number[]) =>
  designs.map((count, index) => ({ index, designs: count }) as Iteration)

test('it counts evaluations, whatever the size of the batches', () => {
  expect(budgetSpent(job(3, 75))).toEqual({ done: 75, planned: 100 })
  expect(budgetSpent(job(52, 100))).toEqual({ done: 100, planned: 100 })
})

test('iterations received from the stream count before the job is loaded again', () => {
  expect(budgetSpent(job(1, 25), followed(25, 25)).done).toBe(50)
  expect(budgetSpent(job(2, 50), followed(25)).done).toBe(50)
})

test('it is written with its unit, and in titles while the job is active', () => {
  expect(spentInWords({ done: 25, planned: 100 })).toBe('25 of 100 evaluations')
  expect(progressInWords({ ...job(1, 25), state: 'running' })).toBe('running 25/100')
  expect(progressInWords({ ...job(4, 100), state: 'succeeded' })).toBe('succeeded')
})
