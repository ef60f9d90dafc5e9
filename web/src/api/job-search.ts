/** Server-side search for jobs to choose from, newest first. */

import type { Choice, Search } from '../components/fields/choice-search'
import { get } from './client'
import type { Job, JobSummary } from './types'

const PAGE = 20

interface Options {
  /** Ids of jobs that are not offered. */
  readonly exclude?: readonly string[]
  /** Value of the choice; the job's id by default. */
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
