/** Jobs to choose from, as the server finds them: by name, id, note or tag, the newest first. */

import type { Choice, Search } from '../components/fields/found-choices'
import { get } from './client'
import type { Job, JobSummary } from './types'

/** Jobs of one page of a picker. */
const PAGE = 20

interface Options {
  /** Ids of jobs that are not offered. */
  readonly without?: readonly string[]
  /** What the choice of a job stands for; its id if missing. */
  readonly value?: (id: string) => string
  readonly note?: (job: JobSummary) => string
}

/** Jobs of a kind; those without a design cannot be chosen. */
export function foundJobs(kind: Job['kind'], options: Options = {}): Search {
  const { without = [], value = (id) => id, note = () => '' } = options
  const choiceOf = (job: JobSummary): Choice => {
    const words = [job.name ? job.id : '', note(job)].filter((part) => part !== '').join(' · ')
    const refused = job.best_fitness === null ? `${job.id} · no design yet` : undefined
    return { value: value(job.id), label: job.name || job.id, note: words, refused }
  }
  return async (text, after, signal) => {
    const query = { kind, search: text, after, limit: PAGE }
    const page = await get('/v1/jobs', { query, signal })
    const items = page.items.filter(({ id }) => !without.includes(id)).map(choiceOf)
    return { items, next: page.next ?? null }
  }
}
