import { describe, expect, test } from 'vitest'
import type { Iteration } from '../../src/api/types'
import { budgetSpent, iterationsSpent } from '../../src/job/facts'

const job = (iterations: number, evaluations: number) => ({
  iterations,
  evaluations,
  particles: 25,
  iterations_planned: 4,
  evaluations_planned: 100,
})

const followed = (...designs: number[]) => designs.map((n) => ({ designs: n }) as Iteration)

describe('the budget spent', () => {
  test('is counted in iterations while all of them are full', () => {
    expect(budgetSpent(job(0, 0))).toEqual({ done: 0, planned: 4, unit: 'iterations' })
    expect(budgetSpent(job(3, 75))).toEqual({ done: 3, planned: 4, unit: 'iterations' })
    expect(budgetSpent(job(4, 100))).toEqual({ done: 4, planned: 4, unit: 'iterations' })
  })

  test('is counted in designs if iterations are smaller', () => {
    expect(budgetSpent(job(3, 31))).toEqual({ done: 31, planned: 100, unit: 'designs' })
    expect(budgetSpent(job(52, 100))).toEqual({ done: 100, planned: 100, unit: 'designs' })
  })

  test('follows the stream if it is ahead of the job', () => {
    expect(budgetSpent(job(1, 25), followed(25, 25)).done).toBe(2)
    expect(budgetSpent(job(1, 1), followed(1, 3, 2))).toMatchObject({ done: 6, unit: 'designs' })
    expect(budgetSpent(job(2, 50), followed(25)).done).toBe(2)
  })

  test('of an unreadable job is counted in iterations', () => {
    const unreadable = { ...job(3, 12), particles: 0, evaluations_planned: 0 }
    expect(budgetSpent(unreadable)).toMatchObject({ done: 3, unit: 'iterations' })
    expect(iterationsSpent(unreadable)).toBe(3)
  })

  test('an extension must exceed the full iterations spent', () => {
    expect(iterationsSpent(job(3, 75))).toBe(3)
    expect(iterationsSpent(job(30, 31))).toBe(2)
  })
})
