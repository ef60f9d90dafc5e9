/** Jobs whose spec the server's version cannot read: they are shown, but nothing follows from them. */

import { get } from './client'
import { ApiProblem } from './problem'
import type { Job, StoredJob } from './types'

/** Whether a job has its spec. */
export function isReadable(job: StoredJob): job is Job {
  return job.spec !== null
}

/** A job with its spec; rejects with the reason if the server cannot read it. */
export async function readableJob(id: string, signal?: AbortSignal): Promise<Job> {
  const job = await get('/v1/jobs/{job_id}', { path: { job_id: id }, signal })
  if (isReadable(job)) return job
  throw new ApiProblem(409, job.error ?? `the spec of job ${id} cannot be read`)
}
