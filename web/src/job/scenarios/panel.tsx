/** Utilities and objectives of the winner by scenario, compared with a reference. */

import { get } from '../../api/client'
import { type Resource, useResource } from '../../api/resource'
import type { Job, Preference, RecordingView, ReferenceView, ScenarioResult } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { type Column, Table } from '../../components/table/table'
import { Term } from '../../components/term'
import { change, formatNumber, quantity } from '../../format/number'
import { capitalized, inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { Bars } from '../bars'
import { caseWords, fitnessUnit } from '../facts'
import { utilityOf } from '../preference'
import { amountOf, MARKS, type Quantity, quantityOf } from '../quantity'
import { ownReference, type Reference, ReferencePicker, useReference } from '../reference'
import './notes.css'

interface Row {
  readonly scenario: string
  readonly label: string
  readonly winner: ScenarioResult
  readonly other: ScenarioResult | null
  readonly utility: number | null
  readonly otherUtility: number | null
}

/** own: the job's reference, if it is known. */
export default function ScenariosPanel({ job, own }: { job: Job; own: ReferenceView | null }) {
  const { query } = usePlace()
  const choice = query.get('against') ?? ownReference(job, own) ?? 'none'
  const reference = useReference(job, choice)
  const recordings = useRecordings(job)
  const words = caseWords(job.kind)
  if (!job.best) {
    return (
      <EmptyCard title="No winner yet">
        {`No design has succeeded in every ${words.item} yet. Results appear here once one has.`}
      </EmptyCard>
    )
  }
  const rows = rowsOf(job, reference.data, recordings.data)
  const label = reference.data?.label ?? null
  return (
    <div class="stack">
      {job.kind === 'identification' && <RecordingsCard recordings={recordings} />}
      <div class="row">
        <ReferencePicker
          job={job}
          own={ownReference(job, own)}
          choice={choice}
          label={label}
          onChoose={(against) => setQuery({ against })}
        />
      </div>
      <Loaded resource={reference} what="the reference" />
      <UtilityCard job={job} rows={rows} label={label} />
      <Card title="Objectives of the winner">
        <Table
          caption={`Objectives of the winner by ${words.item}`}
          rows={rows}
          columns={objectiveColumns(job, label !== null)}
        />
        {label !== null && (
          <p class="muted small table-note">
            Each cell shows the winner, the reference ({label}) and the relative difference.
            {isRanked(job) && ' Colours and marks show what is better.'}
          </p>
        )}
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
      </Card>
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
    const recording = recordings?.find(({ name }) => name === scenario)
    const label = recording ? `${recording.scenario} (${scenario})` : scenario
    return { scenario, label, winner, other, utility: winner.utility, otherUtility }
  })
}

interface UtilityCardProps {
  job: Job
  rows: readonly Row[]
  label: string | null
}

/** Bars of the winner's utilities, with those of a reference. label: of the reference, if any. */
function UtilityCard({ job, rows, label }: UtilityCardProps) {
  const unit = fitnessUnit(job)
  const { item, measure, note } = caseWords(job.kind)
  const title = `${capitalized(measure)} by ${item}`
  const bar = (value: number | null, colour: `--${string}`) => ({
    value,
    text: value === null ? 'not simulated' : quantity(value, unit),
    colour,
  })
  const other: Column<Row> = {
    key: 'other',
    label: label ?? '',
    unit,
    digits: 4,
    value: (r) => r.otherUtility,
  }
  return (
    <ChartCard
      title={title}
      note={
        <>
          {measure === 'utility' && (
            <>
              The <Term name="utility" /> weighs the objectives by the <Term name="preference" />.{' '}
            </>
          )}
          {note}; lower is better. The {item} with the longest bar limits the winner.
        </>
      }
      legend={
        <>
          <LegendEntry colour="--series-1" label="winner" area />
          {label !== null && <LegendEntry colour="--series-6" label={label} area />}
        </>
      }
      table={() => (
        <Table<Row>
          caption={title}
          rows={rows}
          columns={[
            { key: item, header: true, value: (r) => r.label },
            { key: 'winner', unit, digits: 4, value: (r) => r.utility },
            ...(label === null ? [] : [other]),
          ]}
        />
      )}
    >
      <Bars
        rows={rows.map(({ label: name, utility, otherUtility }) => ({
          name,
          bars: [
            bar(utility, '--series-1'),
            ...(label === null ? [] : [bar(otherUtility, '--series-6')]),
          ],
        }))}
        most={Math.max(...rows.flatMap((r) => [r.utility ?? 0, r.otherUtility ?? 0]), 1e-12)}
      />
    </ChartCard>
  )
}

function objectiveColumns(job: Job, compared: boolean): readonly Column<Row>[] {
  const { iteration, particle } = job.best!
  // Scenarios of perturbed worlds are not presets.
  const isPreset = job.spec.kind === 'tuning' && !job.spec.worlds
  return [
    {
      key: caseWords(job.kind).item,
      header: true,
      value: ({ label }) => label,
      cell: ({ label, scenario }) =>
        isPreset ? (
          <a href={withQuery('/walk', { job: job.id, iteration, particle, scenario })}>{label}</a>
        ) : (
          label
        ),
    },
    ...job.objectives.map((objective): Column<Row> => {
      const shown = quantityOf(objective)
      return {
        key: shown.name,
        label: inWords(shown.name),
        unit: shown.unit,
        numeric: true,
        value: ({ winner }) => amountOf(winner, shown),
        cell: ({ winner, other }) => (
          <Compared
            quantity={isRanked(job) ? shown : null}
            winner={amountOf(winner, shown)}
            other={compared ? amountOf(other, shown) : undefined}
          />
        ),
      }
    }),
  ]
}

interface ComparedProps {
  /** Null if neither more nor less is better. */
  quantity: Quantity | null
  winner: number | null
  other: number | null | undefined
}

function Compared({ quantity, winner, other }: ComparedProps) {
  if (other === undefined) return <>{formatNumber(winner)}</>
  // A ratio of values with different signs is meaningless.
  const comparable = winner !== null && other !== null && winner > 0 && other > 0
  const share = comparable ? (winner / other - 1) * 100 : null
  const isSame = quantity === null || share === null || Math.abs(share) < 0.05
  const tone = isSame ? 'same' : share > 0 === quantity.more ? 'better' : 'worse'
  return (
    <span class="compared">
      <span>{formatNumber(winner)}</span>
      <span class="muted small">
        {formatNumber(other)}{' '}
        {share !== null && (
          <span data-tone={tone}>
            {!isSame && `${MARKS[tone]} `}
            {change(share, '%', 2)}
          </span>
        )}
      </span>
    </span>
  )
}

interface RecordingSummary extends RecordingView {
  readonly name: string
}

/** Recordings of an identification, in its order; no requests for other jobs. */
function useRecordings({ spec, scenarios }: Job): Resource<readonly RecordingSummary[]> {
  const ids = spec.kind === 'identification' ? spec.recordings : []
  const path = '/v1/recordings/{recording_id}/summary'
  return useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    Promise.all(
      ids.map(async (id, k) => {
        const recording = await get(path, { path: { recording_id: id }, signal })
        return { ...recording, name: scenarios[k] }
      }),
    ),
  )
}

function RecordingsCard({ recordings }: { recordings: Resource<readonly RecordingSummary[]> }) {
  return (
    <Card title="Recordings">
      <Loaded resource={recordings} what="the recordings">
        {(rows) => (
          <Table<RecordingSummary>
            caption="Recordings"
            rows={rows}
            columns={[
              { key: 'recording', header: true, value: (r) => r.name },
              { key: 'scenario', value: (r) => r.scenario },
              { key: 'controller', minor: true, value: (r) => r.controller },
              {
                key: 'source',
                minor: true,
                value: (r) => (r.synthetic ? 'simulated' : 'measured'),
              },
              { key: 'duration', unit: 's', digits: 3, value: (r) => r.seconds },
              { key: 'mean current', unit: 'A', digits: 3, value: (r) => r.mean_current },
            ]}
          />
        )}
      </Loaded>
    </Card>
  )
}
