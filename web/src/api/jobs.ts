/** Jobs that this server version can read, their robots, and the search for jobs to select. */

import type { Choice, Search } from '../components/fields/choice-search'
import { get } from './client'
import { ApiProblem } from './problem'
import type { Job, JobSpec, JobSummary, StoredJob } from './types'

export function isReadable(job: StoredJob): job is Job {
  return job.spec !== null
}

/** Fetch a job with its spec; rejects if the server cannot read the spec. */
export async function readableJob(id: string, signal?: AbortSignal): Promise<Job> {
  const job = await get('/v1/jobs/{job_id}', { path: { job_id: id }, signal })
  if (isReadable(job)) return job
  throw new ApiProblem(409, job.error ?? `the spec of job ${id} cannot be read`)
}

/** Whether the published designs and the preset scenarios apply: those of Szabadka-II and its variants. */
export function isPublished(robot: JobSpec['robot'] | undefined): boolean {
  return robot === undefined || typeof robot === 'string' || !('toml' in robot)
}

export const NOT_PUBLISHED = 'There is no published design for this robot.'

const PAGE = 20

interface Options {
  readonly exclude?: readonly string[]
  readonly value?: (id: string) => string
  readonly note?: (job: JobSummary) => string
}

/** Search jobs of a kind; jobs without a result cannot be chosen. */
export function jobSearch(kind: Job['kind'], options: Options = {}): Search {
  const { exclude = [], value = (id) => id, note = () => '' } = options
  const choiceOf = (job: JobSummary): Choice => {
    const words = [job.name ? job.id : '', note(job)].filter((part) => part !== '').join(' · ')
    const refused = job.best_fitness === null ? `${job.id} · no result yet` : undefined
    return { value: value(job.id), label: job.name || job.id, note: words, refused }
  }
  return async (text, after, signal) => {
    const query = { kind, search: text, after, limit: PAGE }
    const page = await get('/v1/jobs', { query, signal })
    const items = page.items.filter(({ id }) => !exclude.includes(id)).map(choiceOf)
    return { items, next: page.next ?? null }
  }
}
