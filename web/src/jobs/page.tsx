/** List of jobs, filtered, sorted and paged by the server; polled while the tab is visible. */

import type { ComponentChildren } from 'preact'
import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { ApiProblem } from '../api/problem'
import { useNow, usePolling, useResource } from '../api/resource'
import type { JobFacets, JobState, JobSummary } from '../api/types'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { Check, Select } from '../components/fields/controls'
import { Pager, Table } from '../components/table/table'
import { formatCount } from '../format/number'
import { capitalized } from '../format/words'
import { lazyPage } from '../router/lazy-page'
import { setQuery, usePlace } from '../router/navigation'
import { ignore } from '../router/query-value'
import { jobColumns } from './columns'
import {
  descends,
  FACETS,
  type Facet,
  FIRST_PAGE,
  isFiltered,
  type ListQuery,
  listQuery,
  ORDERS,
  type Order,
  PAGE,
  reordered,
  STATES,
} from './list-query'
import { SavedViews } from './saved-views'
import { jobsInWords, Selection, useSelected } from './selection'
import { useSparklines } from './sparkline'
import './jobs.css'

const FirstRun = lazyPage('the first view', () => import('./first-run'))

export function JobsPage() {
  const place = usePlace()
  const query = listQuery(place.query)
  // Cursors of the previous pages, so that Previous, Back and reload work.
  const cursors = place.query.getAll('after')
  const setCursors = (after: readonly string[]) => setQuery({ after }, { replace: false })
  const [selected, setSelected] = useSelected()
  const [beginning, setBeginning] = useState(false)
  const { page, error, announcement, reload } = useList(query, cursors.at(-1) ?? null)
  const facets = useFacets(query.archived)
  const now = useNow(1000)
  const lines = useSparklines(page?.items ?? [])
  const jobs = page?.items ?? null
  const wrongCursor = error instanceof ApiProblem && error.errors[0]?.field === 'after'
  useEffect(() => {
    if (!wrongCursor) return
    ignore('after', cursors.at(-1) ?? '')
    setQuery(FIRST_PAGE)
  }, [wrongCursor])
  const filtered = isFiltered(query)
  const none = jobs?.length === 0 && cursors.length === 0
  const empty = none && !filtered && !query.archived
  if (empty || beginning) return <FirstRun onBegin={setBeginning} />
  return (
    <>
      <header class="page-header">
        <h1>Jobs</h1>
        <a class="button primary" href="/jobs/new">
          New job
        </a>
      </header>
      <div class="stack">
        {error !== null && !wrongCursor && (
          <ErrorNotice
            what={jobs ? 'The list is out of date.' : 'Could not load the jobs.'}
            error={error}
          />
        )}
        {jobs === null && error === null && <Loading what="jobs" />}
        {page !== null && jobs !== null && (
          <section class="card" aria-label="List of jobs">
            <Filters query={query} facets={facets}>
              {countWords(facets, filtered, jobs.length, page.next, cursors.length)}
            </Filters>
            <SavedViews query={place.query} />
            <Selection
              selected={selected}
              query={query}
              more={cursors.length > 0 || page.next !== null}
              onDone={reload}
              onSelect={setSelected}
            />
            {none ? (
              <Empty title="No matching jobs">
                <button type="button" onClick={() => setQuery(NO_FILTER)}>
                  Show all jobs
                </button>
              </Empty>
            ) : (
              <Table
                cards
                caption="Jobs"
                columns={jobColumns(now, { lines, selected, onSelect: setSelected, jobs })}
                rows={jobs}
                rowKey={(job) => job.id}
                external={{
                  order: { column: query.order, descending: descends(query.order, query.reverse) },
                  onOrder: (column) => setQuery(reordered(query, column as Order)),
                }}
                rowData={(job) => ({ 'data-job': job.id, 'data-state': job.state })}
              />
            )}
            {(cursors.length > 0 || page.next !== null) && (
              <Pager
                caption="Jobs"
                shown={`page ${cursors.length + 1}`}
                page=""
                onPage={[
                  cursors.length > 0 ? () => setCursors(cursors.slice(0, -1)) : null,
                  page.next === null ? null : () => setCursors([...cursors, page.next!]),
                ]}
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

/** Number of matches, or a bound if it would require all pages. */
function countWords(
  facets: JobFacets | null,
  filtered: boolean,
  shown: number,
  next: string | null,
  earlier: number,
): string {
  if (!filtered && facets) return jobsInWords(facets.total)
  if (next === null) return jobsInWords(earlier * PAGE + shown)
  return `more than ${formatCount((earlier + 1) * PAGE)} jobs`
}

const POLL_MS = 2000
const FACETS_MS = 15_000
const PAUSE_MS = 150

function useList(query: ListQuery, after: string | null) {
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

function useFacets(archived: boolean): JobFacets | null {
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

const NO_FILTER: Readonly<Record<string, null>> = {
  ...FIRST_PAGE,
  search: null,
  archived: null,
  order: null,
  ...Object.fromEntries(FACETS.map((facet) => [facet, null])),
}

interface FiltersProps {
  query: ListQuery
  facets: JobFacets | null
  children: ComponentChildren
}

function Filters({ query, facets, children }: FiltersProps) {
  return (
    <search class="row filters">
      <label>
        <span class="visually-hidden">Search by name, id, note or tag</span>
        <input
          type="search"
          placeholder="Search by name, id, note or tag"
          value={query.search ?? ''}
          onInput={(event) =>
            setQuery({ ...FIRST_PAGE, search: event.currentTarget.value || null })
          }
        />
      </label>
      {FACETS.map((facet) => (
        <FacetFilter key={facet} facet={facet} query={query} facets={facets} />
      ))}
      <Select
        hidden
        label="Order"
        value={query.order}
        options={Object.entries(ORDERS) as [Order, string][]}
        onChoose={(order) => setQuery({ ...FIRST_PAGE, order, reverse: null })}
      />
      <Check
        label="archived"
        checked={query.archived}
        onChange={(on) => setQuery({ ...FIRST_PAGE, archived: on ? '' : null })}
      />
      <span class="muted small" aria-live="polite">
        {children}
      </span>
    </search>
  )
}

interface FacetFilterProps {
  facet: Facet
  query: ListQuery
  facets: JobFacets | null
}

function FacetFilter({ facet, query, facets }: FacetFilterProps) {
  const selected = query[facet]
  const counts: Readonly<Record<string, number>> = facets?.[`${facet}s`] ?? {}
  const names: string[] =
    facet === 'state' ? STATES.filter((s) => s in counts) : Object.keys(counts).sort()
  if (selected !== undefined && !names.includes(selected)) names.push(selected)
  // A single option cannot filter.
  if (selected === undefined && names.length < 2 && facet !== 'state') return null
  const total = facet === 'state' && facets ? ` (${formatCount(facets.total)})` : ''
  return (
    <Select
      hidden
      label={capitalized(facet)}
      value={selected ?? ''}
      options={[
        ['', `all ${facet}s${total}`],
        ...names.map((name) => [name, `${name} (${formatCount(counts[name] ?? 0)})`] as const),
      ]}
      onChoose={(name) => setQuery({ ...FIRST_PAGE, [facet]: name || null })}
    />
  )
}
