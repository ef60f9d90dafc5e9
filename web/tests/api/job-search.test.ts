import { afterEach, expect, test, vi } from 'vitest'
import { jobSearch } from '../../src/api/jobs'

afterEach(() => vi.unstubAllGlobals())

test('jobs without a result are listed with the reason why they cannot be chosen', async () => {
  const items = [
    { id: 'k2q7', name: 'slow', best_fitness: 17.5 },
    { id: 'm3x8', name: 'waits', best_fitness: null },
    { id: 'n4y9', name: 'chosen before', best_fitness: 18.5 },
  ]
  const fetchMock = vi.fn(async (_: unknown) => Response.json({ items, next: 'later' }))
  vi.stubGlobal('fetch', fetchMock)
  const search = jobSearch('tuning', { exclude: ['n4y9'], note: () => 'linear' })
  const page = await search('a b', null, new AbortController().signal)
  expect(String(fetchMock.mock.calls[0][0])).toContain('kind=tuning&search=a+b')
  expect(page.next).toBe('later')
  expect(page.items.map(({ value, note, refused }) => [value, note, refused])).toEqual([
    ['k2q7', 'k2q7 · linear', undefined],
    ['m3x8', 'm3x8 · linear', 'm3x8 · no result yet'],
  ])
})
