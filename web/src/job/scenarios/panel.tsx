/** Utilities and objectives of the winner by scenario, compared with a reference. */

import { isPublished } from '../../api/robots'
import type { Job, JobSpec, Preference, ScenarioResult } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { change, formatNumber } from '../../format/number'
import { capitalized, inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { caseWords, fitnessUnit } from '../fitness'
import { utilityOf } from '../preference'
import { type Reference, ReferencePicker, useReference } from '../reference'
import { ScenarioFamiliesCard } from './families-card'
import './notes.css'
import { caseLabel, type RecordingSummary, RecordingsCard, useRecordings } from './recordings'
import { UtilityBars } from './utility-bars'

interface Row {
  readonly scenario: string
  /** Display name. */
  readonly label: string
  readonly winner: ScenarioResult
  readonly other: ScenarioResult | null
  readonly utility: number | null
  readonly otherUtility: number | null
}

export function ScenariosPanel({ job }: { job: Job }) {
  const { query } = usePlace()
  const hasPublished = job.kind === 'tuning' && isPublished((job.spec as JobSpec).robot)
  const byDefault = hasPublished ? 'published:fuzzy-pi:A' : 'none'
  const choice = query.get('against') ?? byDefault
  const reference = useReference(job, choice)
  const recordings = useRecordings(job)
  const isFit = job.kind === 'identification'
  const words = caseWords(job.kind)
  if (!job.best) {
    return (
      <section class="card">
        <Empty title="No winner yet">
          <p>
            No design has succeeded in every {words.item} yet. Results appear here once one has.
          </p>
        </Empty>
      </section>
    )
  }
  const rows = rowsOf(job, reference.data, recordings.data)
  return (
    <div class="stack">
      {isFit && <RecordingsCard recordings={recordings} />}
      <div class="row spread">
        <ReferencePicker
          job={job}
          choice={choice}
          label={reference.data?.label ?? null}
          onChoose={(against) => setQuery({ against })}
        />
        {reference.data && isRanked(job) && (
          <Summary job={job} rows={rows} label={reference.data.label} />
        )}
      </div>
      {reference.loading && <Loading what="the reference" />}
      {reference.error && (
        <ErrorNotice
          what="Could not load the reference."
          error={reference.error}
          retry={reference.reload}
        />
      )}
      <UtilityBars
        unit={fitnessUnit(job)}
        words={words}
        rows={rows.map((r) => ({ name: r.label, winner: r.utility, other: r.otherUtility }))}
        label={reference.data?.label ?? null}
        table={() => <UtilityTable job={job} rows={rows} reference={reference.data} />}
      />
      <section class="card" aria-labelledby="objectives">
        <h2 id="objectives">Objectives of the winner</h2>
        <Table
          caption={`Objectives of the winner by ${words.item}`}
          rows={rows}
          rowKey={(row) => row.scenario}
          columns={objectiveColumns(job, reference.data)}
        />
        {reference.data && (
          <p class="muted small table-note">
            Each cell shows the winner, the reference ({reference.data.label}) and the relative
            difference.{isRanked(job) && ' Lower is better.'}
          </p>
        )}
        <ObjectiveNotes job={job} />
      </section>
      {job.kind === 'tuning' && <ScenarioFamiliesCard job={job} />}
    </div>
  )
}

/** Whether lower is better; for a calibration, closer to the targets is. */
function isRanked({ kind }: Job): boolean {
  return kind !== 'calibration'
}

function rowsOf(
  job: Job,
  reference: Reference | null,
  recordings: readonly RecordingSummary[] | null,
): readonly Row[] {
  const preference = job.spec.kind === 'tuning' ? (job.spec.preference as Preference) : null
  return Object.entries(job.best!.scenarios).map(([scenario, winner]) => {
    const other = reference?.scenarios[scenario] ?? null
    // Preferences may differ between jobs: recompute utilities under this job's preference.
    const otherUtility = other && (preference ? utilityOf(other, preference) : other.utility)
    const label = caseLabel(scenario, recordings)
    return { scenario, label, winner, other, utility: winner.utility, otherUtility }
  })
}

/** Relative fitness over the scenarios in which both succeeded. */
function Summary({ job, rows, label }: { job: Job; rows: readonly Row[]; label: string }) {
  const words = caseWords(job.kind)
  const both = rows.filter((row) => row.utility !== null && row.otherUtility !== null)
  if (both.length === 0)
    return (
      <p>
        {label} has no {words.item} in common with this job.
      </p>
    )
  const ratio =
    fitnessOf(
      job,
      both.map((r) => r.utility!),
    ) /
    fitnessOf(
      job,
      both.map((r) => r.otherUtility!),
    )
  const share = Math.abs(ratio - 1) * 100
  return (
    <p data-ratio={ratio}>
      Over {both.length === rows.length ? 'all' : `the ${both.length} common`} {words.items}, the
      winner is <strong>{formatNumber(share, 3)}&nbsp;%</strong> {ratio < 1 ? 'better' : 'worse'}{' '}
      than {label}.
    </p>
  )
}

/** Geometric mean of utilities (eq. 4.2); arithmetic mean of an identification's errors. */
function fitnessOf(job: Job, utilities: readonly number[]): number {
  const mean = (values: readonly number[]) => values.reduce((a, b) => a + b, 0) / values.length
  return job.kind === 'tuning' ? Math.exp(mean(utilities.map(Math.log))) : mean(utilities)
}

function UtilityTable({
  job,
  rows,
  reference,
}: {
  job: Job
  rows: readonly Row[]
  reference: Reference | null
}) {
  const unit = fitnessUnit(job)
  const words = caseWords(job.kind)
  const columns: Column<Row>[] = [
    {
      key: 'scenario',
      label: capitalized(words.item),
      header: true,
      value: (r) => r.label,
    },
    {
      key: 'winner',
      label: 'Winner',
      unit,
      numeric: true,
      value: (r) => r.utility,
      cell: (r) => formatNumber(r.utility),
    },
  ]
  if (reference) {
    columns.push({
      key: 'other',
      label: reference.label,
      unit,
      numeric: true,
      value: (r) => r.otherUtility,
      cell: (r) => formatNumber(r.otherUtility),
    })
  }
  return (
    <Table
      caption={`${capitalized(words.measure)} by ${words.item}`}
      rows={rows}
      rowKey={(r) => r.scenario}
      columns={columns}
    />
  )
}

function objectiveColumns(job: Job, reference: Reference | null): readonly Column<Row>[] {
  const { iteration, particle } = job.best!
  const walk = (scenario: string) =>
    withQuery('/walk', { job: job.id, iteration, particle, scenario })
  return [
    {
      key: 'scenario',
      label: capitalized(caseWords(job.kind).item),
      header: true,
      value: (row) => row.label,
      cell: (row) =>
        // Scenarios of perturbed worlds are not presets.
        job.spec.kind === 'tuning' && !job.spec.worlds ? (
          <a href={walk(row.scenario)}>{row.label}</a>
        ) : (
          row.label
        ),
    },
    ...job.objectives.map(
      (objective): Column<Row> => ({
        key: objective.name,
        label: inWords(objective.name),
        unit: objective.unit,
        numeric: true,
        value: (row) => row.winner.objectives[objective.name] ?? null,
        cell: (row) => (
          <Compared
            ranked={isRanked(job)}
            winner={row.winner.objectives[objective.name]}
            other={reference ? (row.other?.objectives[objective.name] ?? null) : undefined}
          />
        ),
      }),
    ),
  ]
}

function Compared({
  ranked,
  winner,
  other,
}: {
  /** Whether lower is better. */
  ranked: boolean
  winner: number | null
  other: number | null | undefined
}) {
  if (other === undefined) return <>{formatNumber(winner)}</>
  // A ratio of values with different signs is meaningless.
  const comparable = winner !== null && other !== null && winner > 0 && other > 0
  const share = comparable ? (winner / other - 1) * 100 : null
  const tone =
    !ranked || share === null || Math.abs(share) < 0.05 ? 'same' : share < 0 ? 'better' : 'worse'
  return (
    <span class="compared">
      <span>{formatNumber(winner)}</span>
      <span class="muted small">
        {formatNumber(other)}{' '}
        {share !== null && <span data-tone={tone}>{change(share, '%', 2)}</span>}
      </span>
    </span>
  )
}

/** Descriptions of the objectives. */
function ObjectiveNotes({ job }: { job: Job }) {
  return (
    <details class="small notes-fold">
      <summary>Descriptions of the objectives</summary>
      <dl class="notes">
        {job.objectives.map(({ name, description }) => (
          <div key={name}>
            <dt>{inWords(name)}</dt>
            <dd class="muted">{description}</dd>
          </div>
        ))}
      </dl>
    </details>
  )
}
