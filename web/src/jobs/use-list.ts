/** One page of the job list and its filter options, polled while the tab is visible. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { usePolling, useResource } from '../api/resource'
import type { JobFacets, JobState, JobSummary } from '../api/types'
import { type ListQuery, PAGE } from './list-query'

const POLL_MS = 2000
const FACETS_MS = 15_000
const PAUSE_MS = 150

export function useList(query: ListQuery, after: string | null) {
  const [announcement, setAnnouncement] = useState('')
  const states = useRef(new Map<string, JobState>())
  const list = useResource(
    JSON.stringify([query, after]),
    (signal) => get('/v1/jobs', { query: { ...query, after, limit: PAGE }, signal }),
    { keep: true, pause: PAUSE_MS },
  )
  usePolling(list.reload, POLL_MS)
  useEffect(() => {
    const jobs = list.data?.items ?? []
    const news = changeOfState(states.current, jobs)
    if (news !== null) setAnnouncement(news)
    for (const job of jobs) states.current.set(job.id, job.state)
  }, [list.data])
  return { page: list.data, error: list.error, announcement, reload: list.reload }
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
