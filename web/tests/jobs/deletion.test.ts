import { describe, expect, test } from 'vitest'
import { ApiProblem } from '../../src/api/problem'
import type { JobSummary } from '../../src/api/types'
import { deleteAll, fateOf, lostWith } from '../../src/jobs/deletion'

const job = (id: string, more: Partial<JobSummary> = {}) =>
  ({
    id,
    name: `job ${id}`,
    state: 'succeeded',
    kept: false,
    iterations: 3,
    evaluations: 12,
    links: { delete: `/v1/jobs/${id}` },
    ...more,
  }) as JobSummary

describe('deleting several jobs', () => {
  test('asks for those that may be, names the others, and counts what is lost', () => {
    const jobs = [
      job('a'),
      job('b', { state: 'running', links: {} }),
      job('c', { kept: true, links: {} }),
      job('d'),
    ]
    const { deletable, refused } = fateOf(jobs)
    expect(deletable.map(({ id }) => id)).toEqual(['a', 'd'])
    expect(refused.map(({ name, reason }) => [name, reason])).toEqual([
      ['job b', 'it is running; cancel or pause it first'],
      ['job c', 'it is kept; release it first, on its page'],
    ])
    expect(lostWith(deletable)).toEqual({ iterations: 6, evaluations: 24 })
  })

  test('goes on after one that is refused, and takes one that is gone for deleted', async () => {
    const asked: string[] = []
    const done = await deleteAll(
      ['a', 'b', 'c', 'd', 'e'].map((id) => job(id)),
      async (id) => {
        asked.push(id)
        if (id === 'b') throw new ApiProblem(409, 'cannot delete a job that is kept')
        if (id === 'c') throw new ApiProblem(404, 'no such job')
      },
    )
    expect(asked).toEqual(['a', 'b', 'c', 'd', 'e'])
    expect(done.deleted).toEqual(['a', 'c', 'd', 'e'])
    expect(done.refused).toEqual([
      { id: 'b', name: 'job b', reason: 'cannot delete a job that is kept' },
    ])
  })

  test('stops where the server is away', async () => {
    const away = () => Promise.reject(new ApiProblem(0, 'the server cannot be reached'))
    await expect(deleteAll([job('a')], away)).rejects.toThrow('cannot be reached')
  })
})
