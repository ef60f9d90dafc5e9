import { expect, test } from 'vitest'
import type { Activity } from '../../../src/api/types'
import { timelineOf } from '../../../src/job/activity/timeline'

const at = (seconds: number) => new Date(1e12 + 1000 * seconds).toISOString()

const task = (worker: string, begun: number, seconds: number, more: object = {}) => ({
  iteration: 0,
  worker,
  begun_at: at(begun),
  seconds,
  compute_seconds: seconds / 2,
  walks: 8,
  error: null,
  ...more,
})

test('overlapping tasks of a machine go to separate lanes, others share one', () => {
  const activity = {
    tasks: [task('b', 0, 2), task('a', 1, 1), task('b', 1, 2), task('b', 2, 1)],
    iterations: [
      { iteration: 0, begun_at: at(-9), seconds: 1, designs: 2, error: null },
      { iteration: 1, begun_at: at(1.5), seconds: null, designs: 2, error: null },
    ],
  } as unknown as Activity
  const { workers, iterations, seconds } = timelineOf(activity, 10)
  expect(workers.map(({ worker, lanes }) => [worker, lanes.map((l) => l.length)])).toEqual([
    ['a', [1]],
    ['b', [2, 1]],
  ])
  expect(seconds).toBe(3)
  expect(iterations).toEqual([{ iteration: 1, start: 1.5 }])
  expect(workers[0].lanes[0][0]).toMatchObject({ start: 1, end: 2, computed: 0.5 })
})

test('only the last tasks are shown, and there may be none', () => {
  const many = { tasks: [task('a', 0, 1), task('a', 5, 1)], iterations: [] } as unknown as Activity
  expect(timelineOf(many, 1).seconds).toBe(1)
  const none = { tasks: [], iterations: [] } as unknown as Activity
  expect(timelineOf(none, 5)).toEqual({ workers: [], iterations: [], seconds: 0 })
})
