/** Jobs whose spec this server version can read. */

import { get } from './client'
import { ApiProblem } from './problem'
import type { Job, StoredJob } from './types'

export function isReadable(job: StoredJob): job is Job {
  return job.spec !== null
}

/** Fetch a job with its spec; rejects if the server cannot read the spec. */
export async function readableJob(id: string, signal?: AbortSignal): Promise<Job> {
  const job = await get('/v1/jobs/{job_id}', { path: { job_id: id }, signal })
  if (isReadable(job)) return job
  throw new ApiProblem(409, job.error ?? `the spec of job ${id} cannot be read`)
}
