/** The winner scenario by scenario: utilities and objectives, beside those of a reference. */

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
import { ObjectiveNotes } from './objective-notes'
import { caseLabel, type RecordingSummary, RecordingsCard, useRecordings } from './recordings'
import { UtilityBars } from './utility-bars'

interface Row {
  readonly scenario: string
  /** What people call it. */
  readonly label: string
  readonly own: ScenarioResult
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
            No design has walked in every {words.one} so far. Its results appear here as soon as one
            has.
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
          what="The reference cannot be shown."
          error={reference.error}
          retry={reference.reload}
        />
      )}
      <UtilityBars
        unit={fitnessUnit(job)}
        words={words}
        rows={rows.map((r) => ({ name: r.label, own: r.utility, other: r.otherUtility }))}
        label={reference.data?.label ?? null}
        table={() => <UtilityTable job={job} rows={rows} reference={reference.data} />}
      />
      <section class="card" aria-labelledby="objectives">
        <h2 id="objectives">Objectives of the winner</h2>
        <Table
          caption={`Objectives of the winner by ${words.one}`}
          rows={rows}
          rowKey={(row) => row.scenario}
          columns={objectiveColumns(job, reference.data)}
        />
        {reference.data && (
          <p class="muted small table-note">
            In each cell: the winner, then {reference.data.label} and how much the winner is above
            or below it.{isRanked(job) && ' Less is better everywhere.'}
          </p>
        )}
        <ObjectiveNotes job={job} />
      </section>
      {job.kind === 'tuning' && <ScenarioFamiliesCard job={job} />}
    </div>
  )
}

/** Whether less is better; the results of a calibration are to come near to its targets instead. */
function isRanked({ kind }: Job): boolean {
  return kind !== 'calibration'
}

function rowsOf(
  job: Job,
  reference: Reference | null,
  recordings: readonly RecordingSummary[] | null,
): readonly Row[] {
  const preference = job.spec.kind === 'tuning' ? (job.spec.preference as Preference) : null
  return Object.entries(job.best!.scenarios).map(([scenario, own]) => {
    const other = reference?.scenarios[scenario] ?? null
    // Another job may have another preference: its utilities are not to be compared, its objectives are.
    const otherUtility = other && (preference ? utilityOf(other, preference) : other.utility)
    const label = caseLabel(scenario, recordings)
    return { scenario, label, own, other, utility: own.utility, otherUtility }
  })
}

/** Fitness of both over the scenarios that both have walked in. */
function Summary({ job, rows, label }: { job: Job; rows: readonly Row[]; label: string }) {
  const words = caseWords(job.kind)
  const both = rows.filter((row) => row.utility !== null && row.otherUtility !== null)
  if (both.length === 0)
    return (
      <p>
        {label} has no {words.one} in common with this job.
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
      Over {both.length === rows.length ? 'all' : `the ${both.length} common`} {words.many} the
      winner is <strong>{formatNumber(share, 3)}&nbsp;%</strong> {ratio < 1 ? 'better' : 'worse'}{' '}
      than {label}.
    </p>
  )
}

/** Geometric mean of utilities (eq. 4.2); of an identification's errors the plain mean. */
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
      label: capitalized(words.one),
      header: true,
      value: (r) => r.label,
    },
    {
      key: 'own',
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
      caption={`${capitalized(words.worth)} by ${words.one}`}
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
      label: capitalized(caseWords(job.kind).one),
      header: true,
      value: (row) => row.label,
      cell: (row) =>
        // A scenario of one of a job's worlds is no preset.
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
        value: (row) => row.own.objectives[objective.name] ?? null,
        cell: (row) => (
          <Compared
            ranked={isRanked(job)}
            own={row.own.objectives[objective.name]}
            other={reference ? (row.other?.objectives[objective.name] ?? null) : undefined}
          />
        ),
      }),
    ),
  ]
}

function Compared({
  ranked,
  own,
  other,
}: {
  /** Whether less is better. */
  ranked: boolean
  own: number | null
  other: number | null | undefined
}) {
  if (other === undefined) return <>{formatNumber(own)}</>
  // Between numbers that change their sign, a share says nothing.
  const comparable = own !== null && other !== null && own > 0 && other > 0
  const share = comparable ? (own / other - 1) * 100 : null
  const tone =
    !ranked || share === null || Math.abs(share) < 0.05 ? 'same' : share < 0 ? 'better' : 'worse'
  return (
    <span class="compared">
      <span>{formatNumber(own)}</span>
      <span class="muted small">
        {formatNumber(other)}{' '}
        {share !== null && <span data-tone={tone}>{change(share, '%', 2)}</span>}
      </span>
    </span>
  )
}
