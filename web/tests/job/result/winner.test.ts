import { expect, test } from 'vitest'
import type { Variable } from '../../../src/api/types'
import { gainOf } from '../../../src/job/gain'
import { endInWords, noticeState } from '../../../src/job/header/end-notice'
import { winnerVariables } from '../../../src/job/result/model'

const variable = (name: string, low: number | null, high: number | null) =>
  ({ name, unit: 'V', low, high, kind: 'continuous' }) as unknown as Variable

test('each variable of the winner has a position between its bounds', () => {
  const rows = winnerVariables({ P: 2, I: 0.5, D: 10, law: 'fuzzy', stride: 0.06 }, [
    variable('P', 2, 4),
    variable('I', 0, 2),
    variable('D', 0, 10),
    variable('law', null, null),
  ])
  expect(rows.map(({ name, share, at, fixed }) => [name, share, at, fixed])).toEqual([
    ['P', 0, 'low', false],
    ['I', 0.25, null, false],
    ['D', 1, 'high', false],
    ['law', null, null, false],
    ['stride', null, null, true],
  ])
  // A published design may be outside the search bounds.
  expect(winnerVariables({ P: 7 }, [variable('P', 2, 4)])[0]).toMatchObject({
    share: 1,
    at: 'high',
  })
})

test('a gain requires a successful reference and a best design', () => {
  const published = { name: 'A', kind: 'published', fitness: 20 } as const
  expect(gainOf(published, 15, null).share).toBe(0.25)
  expect(gainOf(published, null, null).share).toBeNull()
  expect(gainOf({ ...published, fitness: null }, 15, 'it falls')).toEqual({
    reference: null,
    share: null,
    reason: 'it falls',
  })
})

test('a gain names its reference: a published design, or the start design', () => {
  const published = { name: 'A', kind: 'published', fitness: 20 } as const
  const start = { name: 'start design', kind: 'start', fitness: 20 } as const
  expect(gainOf(published, 15, null).reference?.label).toBe('published A')
  expect(gainOf(start, 15, null).reference?.label).toBe('start design')
})

test('a notification states how the job ended, if the browser allows it', () => {
  const job = { id: 'k2', name: '', state: 'succeeded', evaluations: 25, error: null } as const
  expect(endInWords({ ...job, best_fitness: 12.5 })).toEqual({
    title: 'k2: succeeded',
    body: '25 evaluations, best fitness 12.500',
  })
  expect(endInWords({ ...job, best_fitness: null }).body).toContain('no design walks')
  expect(endInWords({ ...job, best_fitness: 1, state: 'failed', error: 'no robot' }).body).toBe(
    'no robot',
  )
  expect(noticeState('denied', false)).toMatchObject({ label: null, on: false })
  expect(noticeState('missing', false).label).toBeNull()
  expect(noticeState('granted', true)).toMatchObject({ on: true })
  expect(noticeState('default', false).hint).toBeNull()
})
