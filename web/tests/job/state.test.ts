import { expect, test } from 'vitest'
import type { Iteration } from '../../src/api/types'
import { hasEnded, isActive, isRunning, progressInWords } from '../../src/job/facts'

const STATES = [
  'queued',
  'running',
  'pausing',
  'paused',
  'succeeded',
  'failed',
  'cancelled',
] as const

test('states are classified by whether the job may progress', () => {
  const those = (is: (job: { state: (typeof STATES)[number] }) => boolean) =>
    STATES.filter((state) => is({ state }))
  expect(those(hasEnded)).toEqual(['succeeded', 'failed', 'cancelled'])
  expect(those(isActive)).toEqual(['queued', 'running', 'pausing'])
  expect(those(isRunning)).toEqual(['running', 'pausing'])
})

test('progress is shown until a job has ended', () => {
  const job = {
    iterations: 3,
    evaluations: 12,
    particles: 4,
    iterations_planned: 6,
    evaluations_planned: 24,
  }
  const followed = Array.from({ length: 5 }, () => ({ designs: 4 }) as Iteration)
  expect(progressInWords({ ...job, state: 'running' })).toBe('running 12/24')
  expect(progressInWords({ ...job, state: 'running' }, followed)).toBe('running 20/24')
  expect(progressInWords({ ...job, state: 'paused' })).toBe('paused 12/24')
  expect(progressInWords({ ...job, state: 'failed' })).toBe('failed')
})
