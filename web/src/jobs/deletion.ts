/** Deleting several jobs: which may be, what is lost, and what came of it. */

import { get } from '../api/client'
import { ApiProblem } from '../api/problem'
import type { JobSummary } from '../api/types'

/** Requests under way at once. */
const AT_ONCE = 4

interface Refused {
  readonly id: string
  readonly name: string
  /** Why the job stays. */
  readonly reason: string
}

/** What would become of chosen jobs. */
export interface Fate {
  readonly deletable: readonly JobSummary[]
  readonly refused: readonly Refused[]
}

export interface Deletion {
  readonly deleted: readonly string[]
  readonly refused: readonly Refused[]
}

/** The chosen jobs as they are now; a list may be some seconds old, or show another page. */
export async function lookedUp(ids: readonly string[]): Promise<Fate> {
  const found = await inTurn(ids, (id) =>
    get('/v1/jobs/{job_id}', { path: { job_id: id } }).catch((error: unknown) => {
      if (error instanceof ApiProblem && error.status === 404) return null
      throw error
    }),
  )
  return fateOf(found.filter((job) => job !== null))
}

/** Jobs by whether the server lets them be deleted. */
export function fateOf(jobs: readonly JobSummary[]): Fate {
  return {
    deletable: jobs.filter((job) => 'delete' in job.links),
    refused: jobs
      .filter((job) => !('delete' in job.links))
      .map((job) => ({
        id: job.id,
        name: job.name,
        reason: job.kept
          ? 'it is kept; release it first, on its page'
          : `it is ${job.state}; cancel or pause it first`,
      })),
  }
}

/** Iterations and designs that go with jobs. */
export function lostWith(jobs: readonly JobSummary[]) {
  return {
    iterations: jobs.reduce((sum, job) => sum + job.iterations, 0),
    evaluations: jobs.reduce((sum, job) => sum + job.evaluations, 0),
  }
}

/** Delete each; one that cannot be keeps no other from it. Throws if the server is away. */
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
      // Somebody else was faster.
      return error.status === 404 ? null : { id, name, reason: error.message }
    }
  })
  const refused = results.filter((result) => result !== null)
  const stayed = new Set(refused.map(({ id }) => id))
  return { deleted: jobs.map(({ id }) => id).filter((id) => !stayed.has(id)), refused }
}

/** Results in the order of the items, of which a few are worked at together. */
async function inTurn<T, R>(items: readonly T[], work: (item: T) => Promise<R>): Promise<R[]> {
  const results: R[] = []
  for (let begin = 0; begin < items.length; begin += AT_ONCE) {
    results.push(...(await Promise.all(items.slice(begin, begin + AT_ONCE).map(work))))
  }
  return results
}
