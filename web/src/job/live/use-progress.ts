/** Progress of a job, for other pages. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { usePolling } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { isActive, progressInWords } from '../facts'

const RENEW_MS = 4000

export function useProgress(initial: StoredJob | undefined): string | null {
  const [renewed, setRenewed] = useState(initial)
  const job = renewed?.id === initial?.id ? renewed : initial
  const active = job !== undefined && isActive(job)
  const renew = (id: string) =>
    // Keep the previous state until a response arrives.
    get('/v1/jobs/{job_id}', { path: { job_id: id } }).then(setRenewed, () => undefined)
  usePolling(() => active && renew(job.id), RENEW_MS, active)
  return active ? progressInWords(job) : null
}
