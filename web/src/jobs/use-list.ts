/** One page of the job list and its filter options, polled while the tab is visible. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { LatestAnswer } from '../api/latest-answer'
import { usePolling, useResource } from '../api/resource'
import type { JobFacets, JobState, JobSummary } from '../api/types'
import { type ListQuery, PAGE } from './list-query'

const POLL_MS = 2000
const FACETS_MS = 15_000
/** Debounce of typing [ms]. */
const PAUSE_MS = 150

interface Page {
  readonly items: readonly JobSummary[]
  readonly next: string | null
}

interface Request {
  readonly query: ListQuery
  readonly after: string | null
}

export function useList(query: ListQuery, after: string | null) {
  const [page, setPage] = useState<Page | null>(null)
  const [error, setError] = useState<unknown>(null)
  const [announcement, setAnnouncement] = useState('')
  const before = useRef(new Map<string, JobState>())
  const [latest] = useState(
    () =>
      new LatestAnswer<Request, Page>(
        (request, signal) =>
          get('/v1/jobs', {
            query: { ...request.query, after: request.after, limit: PAGE },
            signal,
          }),
        (answer) => {
          setPage(answer)
          setError(null)
          const news = changeOfState(before.current, answer.items)
          if (news !== null) setAnnouncement(news)
          for (const job of answer.items) before.current.set(job.id, job.state)
        },
        setError,
        PAUSE_MS,
      ),
  )
  const key = JSON.stringify([query, after])
  useEffect(() => {
    latest.ask({ query, after })
    return () => latest.stop()
  }, [key])
  usePolling(() => latest.ask({ query, after }), POLL_MS)
  const reload = () => latest.ask({ query, after })
  return { page, error, announcement, reload }
}

/** Job counts by filter value; null while loading. */
export function useFacets(archived: boolean): JobFacets | null {
  const counts = useResource(`facets ${archived}`, (signal) =>
    get('/v1/job-facets', { query: { archived }, signal }),
  )
  usePolling(counts.reload, FACETS_MS)
  return counts.data
}

function changeOfState(
  before: ReadonlyMap<string, JobState>,
  now: readonly JobSummary[],
): string | null {
  const changed = now.filter((j) => before.has(j.id) && before.get(j.id) !== j.state)
  if (changed.length === 0) return null
  return changed.map((job) => `${job.name || job.id} is ${job.state}`).join('; ')
}
