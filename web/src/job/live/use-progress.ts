/** How far a job is, for pages that show something else of it. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { usePolling } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { isUnderWay, progressInWords } from '../state'

/** How often a job under way is asked for again [ms]. */
const RENEW_MS = 4000

/** Progress of a job under way, as it was known and then as it is; null for others, and for none. */
export function useProgress(known: StoredJob | undefined): string | null {
  const [renewed, setRenewed] = useState(known)
  const job = renewed?.id === known?.id ? renewed : known
  const active = job !== undefined && isUnderWay(job)
  const renew = (id: string) =>
    // What was known stays until there is an answer.
    get('/v1/jobs/{job_id}', { path: { job_id: id } }).then(setRenewed, () => undefined)
  usePolling(() => active && renew(job.id), RENEW_MS, active)
  return active ? progressInWords(job) : null
}
