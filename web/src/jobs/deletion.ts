/** Changes of several jobs, and restoration of deleted ones. */

import { post } from '../api/client'
import { ApiProblem } from '../api/problem'

const AT_ONCE = 4

/** Session entry of a job deleted on its own page. */
export const DELETED = 'gaitswarm.deleted'

export interface Refused {
  readonly id: string
  readonly reason: string
}

export function restoreJob(id: string) {
  return post('/v1/jobs/{job_id}/restore', { path: { job_id: id } })
}

/** Change each job; refusals do not stop the others. Throws if the server is unreachable. */
export async function changeAll(
  ids: readonly string[],
  send: (id: string) => Promise<unknown>,
): Promise<{ changed: readonly string[]; refused: readonly Refused[] }> {
  const results = await inTurn(ids, async (id) => {
    try {
      await send(id)
      return null
    } catch (error) {
      if (!(error instanceof ApiProblem) || error.status === 0) throw error
      // Without the commands that it names.
      return { id, reason: error.message.split(': `')[0] }
    }
  })
  const refused = results.filter((result) => result !== null)
  const refusedIds = new Set(refused.map(({ id }) => id))
  return { changed: ids.filter((id) => !refusedIds.has(id)), refused }
}

/** Map over the items with limited concurrency, preserving their order. */
async function inTurn<T, R>(items: readonly T[], work: (item: T) => Promise<R>): Promise<R[]> {
  const results: R[] = []
  for (let begin = 0; begin < items.length; begin += AT_ONCE) {
    results.push(...(await Promise.all(items.slice(begin, begin + AT_ONCE).map(work))))
  }
  return results
}
