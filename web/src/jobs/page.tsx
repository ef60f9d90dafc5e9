/** All jobs: how they stand and where to go on. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { useNow, usePolling } from '../api/resource'
import type { JobState, JobSummary } from '../api/types'
import { CopyBlock } from '../components/copy-button'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { matching } from '../components/rows'
import { Table } from '../components/table'
import { formatCount } from '../format/number'
import { setQuery, usePlace } from '../router/navigation'
import { jobColumns } from './columns'
import { JobList } from './job-list'
import './jobs.css'

const STATES: readonly JobState[] = [
  'queued',
  'running',
  'pausing',
  'paused',
  'succeeded',
  'failed',
  'cancelled',
]

const POLL_MS = 2000

export function JobsPage() {
  const { jobs, error, truncated, announcement } = useJobs()
  const { query } = usePlace()
  const now = useNow(1000)
  const text = query.get('search') ?? ''
  const state = STATES.find((s) => s === query.get('state')) ?? null
  const shown = useMemo(() => {
    const inState = state === null ? (jobs ?? []) : (jobs ?? []).filter((j) => j.state === state)
    return matching(inState, text, (job) => `${job.name} ${job.id} ${job.controller ?? ''}`)
  }, [jobs, text, state])
  const columns = jobColumns(now)
  return (
    <>
      <header class="page-header">
        <h1>Jobs</h1>
        <span class="row">
          <a class="button" href="/tournaments">
            Tournaments
          </a>
          <a class="button primary" href="/jobs/new">
            New job
          </a>
        </span>
      </header>
      <div class="stack">
        {error !== null && (
          <ErrorNotice
            what={jobs ? 'The list is not up to date.' : 'The jobs cannot be shown.'}
            error={error}
          />
        )}
        {jobs === null && error === null && <Loading what="jobs" />}
        {jobs !== null && jobs.length === 0 && <NoJobs />}
        {jobs !== null && jobs.length > 0 && (
          <section class="card" aria-label="List of jobs">
            <Filters text={text} state={state} jobs={jobs} shown={shown.length} />
            {truncated && (
              <p class="muted small">
                The newest {formatCount(jobs.length)} jobs; older ones are found by{' '}
                <code>gaitswarm list</code>.
              </p>
            )}
            {shown.length === 0 ? (
              <Empty title="No job fits the filter">
                <button type="button" onClick={() => setQuery({ search: null, state: null })}>
                  Show all jobs
                </button>
              </Empty>
            ) : (
              <Table
                caption="Jobs"
                columns={columns}
                rows={shown}
                rowKey={(job) => job.id}
                rowData={(job) => ({ 'data-job': job.id, 'data-state': job.state })}
              />
            )}
          </section>
        )}
      </div>
      <p class="visually-hidden" role="status">
        {announcement}
      </p>
    </>
  )
}

/** The jobs, renewed while the tab is shown, and the last change of a state in words. */
function useJobs() {
  const [jobs, setJobs] = useState<readonly JobSummary[] | null>(null)
  const [error, setError] = useState<unknown>(null)
  const [announcement, setAnnouncement] = useState('')
  const before = useRef(new Map<string, JobState>())
  const [list] = useState(
    () =>
      new JobList(
        (query) => get('/v1/jobs', { query }),
        (now) => {
          setJobs(now)
          const news = changeOfState(before.current, now)
          if (news !== null) setAnnouncement(news)
          before.current = new Map(now.map((job) => [job.id, job.state]))
        },
      ),
  )
  const busy = useRef(false)
  const attempt = (ask: () => Promise<void>) => {
    if (busy.current) return
    busy.current = true
    ask()
      .then(() => setError(null), setError)
      .finally(() => {
        busy.current = false
      })
  }
  useEffect(() => attempt(() => list.loadAll()), [list])
  usePolling(() => attempt(() => (jobs === null ? list.loadAll() : list.refresh())), POLL_MS)
  return { jobs, error, announcement, truncated: list.truncated }
}

function changeOfState(
  before: ReadonlyMap<string, JobState>,
  now: readonly JobSummary[],
): string | null {
  const changed = now.filter((j) => before.has(j.id) && before.get(j.id) !== j.state)
  if (changed.length === 0) return null
  return changed.map((job) => `${job.name || job.id} is ${job.state}`).join('; ')
}

function Filters({
  text,
  state,
  jobs,
  shown,
}: {
  text: string
  state: JobState | null
  jobs: readonly JobSummary[]
  shown: number
}) {
  const counts = useMemo(() => {
    const found = new Map<JobState, number>()
    for (const job of jobs) found.set(job.state, (found.get(job.state) ?? 0) + 1)
    return found
  }, [jobs])
  return (
    <search class="row filters">
      <label>
        <span class="visually-hidden">Search by name or id</span>
        <input
          type="search"
          placeholder="Search by name or id"
          value={text}
          onInput={(event) => setQuery({ search: event.currentTarget.value || null })}
        />
      </label>
      <label>
        <span class="visually-hidden">State</span>
        <select
          value={state ?? ''}
          onChange={(event) => setQuery({ state: event.currentTarget.value || null })}
        >
          <option value="">all states ({formatCount(jobs.length)})</option>
          {STATES.filter((s) => counts.has(s) || s === state).map((s) => (
            <option key={s} value={s}>
              {s} ({formatCount(counts.get(s) ?? 0)})
            </option>
          ))}
        </select>
      </label>
      <span class="muted small" aria-live="polite">
        {shown === 1 ? '1 job' : `${formatCount(shown)} jobs`}
      </span>
    </search>
  )
}

function NoJobs() {
  return (
    <section class="card">
      <Empty title="No jobs yet">
        <p>A job searches for the controller that walks best in all of its scenarios.</p>
        <p>
          <a class="button primary" href="/jobs/new">
            Set up the first job
          </a>
        </p>
        <p>or, in a terminal, run the job of the thesis’s chapter 4:</p>
        <CopyBlock
          label="the command"
          text={`echo '{"name": "chapter 4"}' > job.json\ngaitswarm submit --spec job.json --server ${location.origin}`}
        />
      </Empty>
    </section>
  )
}
