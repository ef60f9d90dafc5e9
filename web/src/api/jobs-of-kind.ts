/** Jobs to choose from: those of one kind, the newest first, page by page to the last. */

import { get } from './client'
import type { Job, JobSummary } from './types'

const PAGE = 200
/** Nobody looks through more; an id leads to any other. */
const MOST = 2000

export async function jobsOfKind(
  kind: Job['kind'],
  signal: AbortSignal,
): Promise<readonly JobSummary[]> {
  const found: JobSummary[] = []
  let after: string | undefined
  do {
    const page = await get('/v1/jobs', { query: { kind, after, limit: PAGE }, signal })
    found.push(...page.items)
    after = page.next ?? undefined
  } while (after !== undefined && found.length < MOST)
  return found
}
