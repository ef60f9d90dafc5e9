/** Candidates of a search for preferences, and what each of them buys. */

import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type { CandidatePreference, CandidatePreferences, Job } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { type Column, Table } from '../../components/table/table'
import { change, formatCount, formatNumber, percent } from '../../format/number'
import { placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { withQuery } from '../../router/routes'
import { isRunning } from '../facts'
import { preferenceQuery } from '../preference'

const RENEW_MS = 15_000

/** Figures of an optimum and their units, in the order of a preference's weights. */
const FIGURES = [
  ['torque', 'N m'],
  ['acceleration', 'm/s2'],
  ['angular_acceleration', 'rad/s2'],
  ['energy', 'J/m'],
  ['speed', 'm/s'],
  ['slowest', 'm/s'],
] as const

interface Row {
  readonly name: string
  readonly figures: Readonly<Record<string, number>>
  /** Null for the reference. */
  readonly candidate: CandidatePreference | null
}

export default function CandidatesPanel({ job }: { job: Job }) {
  const exists = job.best_fitness !== null
  const view = useResource(exists ? `${job.id} ${job.iterations}` : null, (signal) =>
    get('/v1/jobs/{job_id}/preferences', { path: { job_id: job.id }, signal }),
  )
  usePolling(view.reload, RENEW_MS, isRunning(job))
  if (!exists) {
    return (
      <EmptyCard title="No candidate yet">
        Candidates appear here once a preference has a feasible optimum.
      </EmptyCard>
    )
  }
  return (
    <Loaded resource={view} what="the preferences">
      {(data) => <Candidates job={job} view={data} />}
    </Loaded>
  )
}

function Candidates({ job, view }: { job: Job; view: CandidatePreferences }) {
  const rows: Row[] = [
    ...view.candidates.map((candidate) => ({
      name: candidate.named ?? placeWord(candidate),
      figures: candidate.figures,
      candidate,
    })),
    { name: 'reference', figures: view.reference_figures, candidate: null },
  ]
  const [best] = view.candidates
  return (
    <Card title="Preferences" data={{ 'data-recommended': rows[0].name }}>
      <div class="stack">
        <p>
          Recommended is preference <strong>{rows[0].name}</strong>: in the worst cases, objectives
          of its optimum get worse by a factor of {formatNumber(best.fitness, 3)}. Compared with the
          reference: {boughtInWords(best)}.
        </p>
        <Table
          caption="Preferences and their optima"
          rows={rows}
          columns={columnsOf(job)}
          rowData={({ name }) => ({ 'data-candidate': name })}
        />
        <p class="muted small">
          {formatCount(view.evaluated)} preferences judged, each by the design that is optimal under
          it. Index: sensitivity to the design’s variables. Failed, risk: share of{' '}
          {formatCount(view.worlds)} held-out worlds with a failure, and objectives in the worst
          5&nbsp;% of them by the nominal ones. Uneven: deviation over the scenarios of changes from
          the reference. Factor: exp(0.05 index) · risk · uneven / (1 − failed).
        </p>
      </div>
    </Card>
  )
}

function boughtInWords({ changes }: CandidatePreference): string {
  return FIGURES.map(([name]) => `${inWords(name)} ${change(changes[name] * 100, '%', 2)}`).join(
    ', ',
  )
}

function columnsOf(job: Job): readonly Column<Row>[] {
  const criterion = (key: string, of: (candidate: CandidatePreference) => number) => ({
    key,
    digits: 3,
    value: ({ candidate }: Row) => candidate && of(candidate),
  })
  return [
    { key: 'preference', header: true, value: ({ name }) => name },
    {
      key: 'exponents',
      minor: true,
      cell: ({ candidate }) => (
        <span class="nowrap">
          {candidate?.preference.exponent.map((e) => formatNumber(e, 2)).join(' · ')}
        </span>
      ),
    },
    criterion('factor', (c) => c.fitness),
    ...FIGURES.map(
      ([name, unit]): Column<Row> => ({
        key: name,
        label: inWords(name),
        unit,
        numeric: true,
        value: ({ figures }) => figures[name],
        cell: ({ figures, candidate }) => (
          <span class="nowrap">
            {formatNumber(figures[name], 3)}
            {candidate && (
              <span class="muted small"> {change(candidate.changes[name] * 100, '%', 2)}</span>
            )}
          </span>
        ),
      }),
    ),
    criterion('index', (c) => c.sensitivity),
    {
      key: 'failed',
      numeric: true,
      value: ({ candidate }) => candidate && candidate.failures,
      cell: ({ candidate }) => percent(candidate?.failures, 2),
    },
    criterion('risk', (c) => c.risk),
    criterion('uneven', (c) => c.unevenness),
    {
      key: 'use',
      cell: ({ candidate }) =>
        candidate && (
          <a
            class="nowrap"
            href={withQuery('/jobs/new', {
              clone: job.id,
              preference: preferenceQuery(candidate.preference),
            })}
          >
            Tune by it
          </a>
        ),
    },
  ]
}
