/** Deletion of several jobs. */

import { get } from '../api/client'
import { ApiProblem } from '../api/problem'
import type { JobSummary } from '../api/types'

const AT_ONCE = 4

interface Refused {
  readonly id: string
  readonly name: string
  readonly reason: string
}

export interface DeletionPreview {
  readonly deletable: readonly JobSummary[]
  readonly refused: readonly Refused[]
}

export interface Deletion {
  readonly deleted: readonly string[]
  readonly refused: readonly Refused[]
}

/** Fetch the selected jobs; the list may be outdated, or show another page. */
export async function deletionPreview(ids: readonly string[]): Promise<DeletionPreview> {
  const jobs = await inTurn(ids, (id) =>
    get('/v1/jobs/{job_id}', { path: { job_id: id } }).catch((error: unknown) => {
      if (error instanceof ApiProblem && error.status === 404) return null
      throw error
    }),
  )
  return previewOf(jobs.filter((job) => job !== null))
}

/** Split jobs by whether the server allows their deletion. */
export function previewOf(jobs: readonly JobSummary[]): DeletionPreview {
  return {
    deletable: jobs.filter((job) => 'delete' in job.links),
    refused: jobs
      .filter((job) => !('delete' in job.links))
      .map((job) => ({
        id: job.id,
        name: job.name,
        reason: job.kept
          ? 'it is protected; release it on its page first'
          : `it is ${job.state}; cancel or pause it first`,
      })),
  }
}

export function lostWith(jobs: readonly JobSummary[]) {
  return {
    iterations: jobs.reduce((sum, job) => sum + job.iterations, 0),
    evaluations: jobs.reduce((sum, job) => sum + job.evaluations, 0),
  }
}

/** Delete each job; failures do not stop the others. Throws if the server is unreachable. */
export async function deleteAll(
  jobs: readonly JobSummary[],
  send: (id: string) => Promise<void>,
): Promise<Deletion> {
  const results = await inTurn(jobs, async ({ id, name }) => {
    try {
      await send(id)
      return null
    } catch (error) {
      if (!(error instanceof ApiProblem) || error.status === 0) throw error
      // Already deleted by another client.
      return error.status === 404 ? null : { id, name, reason: error.message }
    }
  })
  const refused = results.filter((result) => result !== null)
  const refusedIds = new Set(refused.map(({ id }) => id))
  return { deleted: jobs.map(({ id }) => id).filter((id) => !refusedIds.has(id)), refused }
}

/** Map over the items with limited concurrency, preserving their order. */
export async function inTurn<T, R>(
  items: readonly T[],
  work: (item: T) => Promise<R>,
): Promise<R[]> {
  const results: R[] = []
  for (let begin = 0; begin < items.length; begin += AT_ONCE) {
    results.push(...(await Promise.all(items.slice(begin, begin + AT_ONCE).map(work))))
  }
  return results
}
