import { describe, expect, test } from 'vitest'
import { ApiProblem } from '../../src/api/problem'
import type { JobSummary } from '../../src/api/types'
import { deleteAll, lostWith, previewOf } from '../../src/jobs/deletion'

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
  test('previews deletable jobs, others with reasons, and the totals lost', () => {
    const jobs = [
      job('a'),
      job('b', { state: 'running', links: {} }),
      job('c', { kept: true, links: {} }),
      job('d'),
    ]
    const { deletable, refused } = previewOf(jobs)
    expect(deletable.map(({ id }) => id)).toEqual(['a', 'd'])
    expect(refused.map(({ name, reason }) => [name, reason])).toEqual([
      ['job b', 'it is running; cancel or pause it first'],
      ['job c', 'it is protected; release it on its page first'],
    ])
    expect(lostWith(deletable)).toEqual({ iterations: 6, evaluations: 24 })
  })

  test('continues after a refusal, and counts missing jobs as deleted', async () => {
    const requested: string[] = []
    const done = await deleteAll(
      ['a', 'b', 'c', 'd', 'e'].map((id) => job(id)),
      async (id) => {
        requested.push(id)
        if (id === 'b') throw new ApiProblem(409, 'the job is protected')
        if (id === 'c') throw new ApiProblem(404, 'no such job')
      },
    )
    expect(requested).toEqual(['a', 'b', 'c', 'd', 'e'])
    expect(done.deleted).toEqual(['a', 'c', 'd', 'e'])
    expect(done.refused).toEqual([{ id: 'b', name: 'job b', reason: 'the job is protected' }])
  })

  test('stops if the server is unreachable', async () => {
    const away = () => Promise.reject(new ApiProblem(0, 'the server cannot be reached'))
    await expect(deleteAll([job('a')], away)).rejects.toThrow('cannot be reached')
  })
})
