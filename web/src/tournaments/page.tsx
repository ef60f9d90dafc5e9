/** Tournaments between search methods: which there are, and what one has come to. */

import { get } from '../api/client'
import { usePolling, useResource } from '../api/resource'
import type { Tournament } from '../api/types'
import { CopyBlock } from '../components/copy-button'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { type Column, Table } from '../components/table/table'
import { formatCount } from '../format/number'
import { formatMoment } from '../format/time'
import { ALL_JOBS, Breadcrumbs } from '../router/breadcrumbs'
import { tournamentPath } from '../router/routes'
import { isUnderWay, runCount } from './methods'
import { StandingsPage } from './standings-page'
import './tournaments.css'

/** How often the list is asked for again while runs are under way [ms]. */
const RENEW_MS = 10_000

export default function TournamentsPage({ id }: { id: string | null }) {
  return id === null ? <AllTournaments /> : <StandingsPage key={id} id={id} />
}

function AllTournaments() {
  const found = useResource('tournaments', (signal) => get('/v1/tournaments', { signal }))
  usePolling(found.reload, RENEW_MS, found.data?.items.some(isUnderWay) ?? false)
  return (
    <>
      <Breadcrumbs crumbs={[ALL_JOBS]} here="Tournaments" />
      <header class="page-header">
        <h1>Tournaments</h1>
      </header>
      <div class="stack">
        {found.error && (
          <ErrorNotice
            what="The tournaments cannot be shown."
            error={found.error}
            retry={found.reload}
          />
        )}
        {found.loading && !found.data && <Loading what="the tournaments" />}
        {found.data &&
          (found.data.items.length === 0 ? <None /> : <List tournaments={found.data.items} />)}
      </div>
    </>
  )
}

function List({ tournaments }: { tournaments: readonly Tournament[] }) {
  return (
    <section class="card" aria-label="List of tournaments">
      <Table
        caption="Tournaments"
        rows={tournaments}
        rowKey={({ id }) => id}
        rowData={({ id }) => ({ 'data-tournament': id })}
        columns={COLUMNS}
      />
    </section>
  )
}

const COLUMNS: readonly Column<Tournament>[] = [
  {
    key: 'problems',
    label: 'Problems',
    header: true,
    value: ({ problems }) => problems.join(),
    cell: ({ id, problems }) => <a href={tournamentPath(id)}>{problemsInWords(problems)}</a>,
  },
  {
    key: 'methods',
    label: 'Methods',
    value: ({ entrants }) => entrants.length,
    cell: ({ entrants }) => entrants.map(({ label }) => label).join(', '),
  },
  {
    key: 'evaluations',
    label: 'Evaluations of a run',
    numeric: true,
    value: ({ evaluations }) => evaluations,
    cell: ({ evaluations }) => formatCount(evaluations),
  },
  {
    key: 'runs',
    label: 'Runs',
    numeric: true,
    value: (tournament) => runCount(tournament).ended,
    cell: (tournament) => {
      const { ended, planned } = runCount(tournament)
      return ended === planned
        ? formatCount(ended)
        : `${formatCount(ended)} of ${formatCount(planned)}`
    },
  },
  {
    key: 'created',
    label: 'Begun',
    minor: true,
    value: ({ created_at }) => created_at,
    cell: ({ created_at }) => <time dateTime={created_at}>{formatMoment(created_at)}</time>,
  },
]

/** A few are named, of more their number is told. */
export function problemsInWords(problems: readonly string[]): string {
  if (problems.length <= 3) return problems.join(', ')
  return `${problems.slice(0, 2).join(', ')} and ${problems.length - 2} more`
}

function None() {
  return (
    <section class="card">
      <Empty title="No tournaments yet">
        <p>
          A tournament runs search methods many times on the same problems, and tells which needs
          the fewest evaluations.
        </p>
        <CopyBlock label="the command" text="gaitswarm tournament thesis --repetitions 10" />
      </Empty>
    </section>
  )
}
