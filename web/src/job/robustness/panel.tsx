/** Sensitivity of the winner to small changes of its variables, and of the winners of preferences. */

import { useState } from 'preact/hooks'
import { post } from '../../api/client'
import { cached, useResource } from '../../api/resource'
import type {
  Job,
  JobSpec,
  PreferenceWinner,
  Robustness,
  RobustnessIndex,
  RobustPreferences,
} from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber, NONE, percent } from '../../format/number'
import { placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { jobPath, withQuery } from '../../router/routes'
import { Bars } from '../bars'
import { DesignLink } from '../columns'
import { searchedVariables } from '../facts'
import { preferenceQuery } from '../preference'

/** Fewest designs simulated around the job's winner, and around the winner of a preference. */
const LEAST_SAMPLES = 128
const LEAST_SAMPLES_EACH = 48

/** Number of winners compared; servers limit the length of simulations. */
const CANDIDATES = 5

function samplesOf(job: Job, least: number): number {
  return Math.max(least, 4 * (searchedVariables(job.spec).length + 1))
}

export default function RobustnessPanel({ job }: { job: Job }) {
  const { best } = job
  const key = best && `${job.id} ${placeWord(best)}`
  const response = useResource(key, () => cached(key!, () => estimate(job)))
  if (!best) {
    return (
      <EmptyCard title="No winner yet">
        Robustness can be estimated once a design has succeeded in every scenario.
      </EmptyCard>
    )
  }
  return (
    <div class="stack" data-robustness={response.data?.index?.value ?? ''}>
      <Loaded
        resource={response}
        what="simulations of designs around the winner"
        failed="Could not estimate the robustness."
      >
        {(robustness) => (
          <>
            <ByScenario robustness={robustness} />
            <ByVariable robustness={robustness} />
          </>
        )}
      </Loaded>
      <PreferencesCard job={job} />
    </div>
  )
}

function estimate(job: Job): Promise<Robustness> {
  const { robot, controller, scenarios } = job.spec as JobSpec
  return post('/v1/robustness', {
    body: {
      robot,
      controller,
      scenarios,
      design: { ...job.best!.design },
      variables: [...searchedVariables(job.spec)],
      samples: samplesOf(job, LEAST_SAMPLES),
      radius: 0.02,
      seed: 1,
      precision: 'double',
    },
  })
}

function barOf(value: number | null, interval: RobustnessIndex | null = null) {
  return [{ value, text: value === null ? 'unknown' : formatNumber(value, 3), interval }]
}

interface IndexRow {
  readonly name: string
  readonly index: RobustnessIndex | null
  readonly by_objective: Readonly<Record<string, number | null>>
  readonly failed: number | null
}

function ByScenario({ robustness }: { robustness: Robustness }) {
  const rows: readonly IndexRow[] = [
    ...Object.entries(robustness.scenarios).map(([name, part]) => ({ ...part, name })),
    { ...robustness, name: 'all', failed: null },
  ]
  return (
    <ChartCard
      title="Robustness index by scenario"
      note="Relative change of the objectives with the variables over their entire bounds; lower is more robust."
      legend={
        <>
          <LegendEntry colour="--series-1" label="winner" area />
          <LegendEntry colour="--text" label="95 % interval" />
        </>
      }
      table={() => (
        <Table<IndexRow>
          caption="Robustness index by scenario"
          rows={rows}
          columns={[
            { key: 'scenario', header: true, value: ({ name }) => name },
            { key: 'index', digits: 3, value: ({ index }) => index?.value ?? null },
            {
              key: '95 % interval',
              numeric: true,
              data: ({ index }) => index && `${index.low} – ${index.high}`,
              cell: ({ index }) =>
                index ? `${formatNumber(index.low, 3)} – ${formatNumber(index.high, 3)}` : NONE,
            },
            ...robustness.objectives.map(
              ({ name }): Column<IndexRow> => ({
                key: name,
                label: inWords(name),
                digits: 3,
                value: (row) => row.by_objective[name] ?? null,
              }),
            ),
            { key: 'failures', numeric: true, value: ({ failed }) => failed },
          ]}
        />
      )}
    >
      <Bars
        rows={rows.map(({ name, index }) => ({ name, bars: barOf(index?.value ?? null, index) }))}
        most={Math.max(...rows.map(({ index }) => index?.high ?? 0), 1e-12)}
      />
      <p class="muted small table-note">
        From {robustness.samples} designs within {percent(robustness.radius, 2)} of each variable’s
        bounds.
        {robustness.held.length > 0 && <> Fixed: {robustness.held.join(', ')}.</>}
      </p>
    </ChartCard>
  )
}

function ByVariable({
  robustness: { by_variable, variables, scenarios },
}: {
  robustness: Robustness
}) {
  const names = variables
    .map(({ name }) => name)
    .sort((a, b) => (by_variable[b] ?? 0) - (by_variable[a] ?? 0))
  return (
    <ChartCard
      title="Sensitivity by variable"
      note="The robustness index by variable, over all scenarios and objectives."
      table={() => (
        <Table<string>
          caption="Sensitivity by variable"
          rows={names}
          columns={[
            { key: 'variable', header: true, value: (name) => name },
            { key: 'all', label: 'all', digits: 3, value: (name) => by_variable[name] ?? null },
            ...Object.entries(scenarios).map(([scenario, part]) => ({
              key: scenario,
              label: scenario,
              digits: 3,
              value: (name: string) => part.by_variable[name] ?? null,
            })),
          ]}
        />
      )}
    >
      <Bars
        rows={names.map((name) => ({ name, bars: barOf(by_variable[name] ?? null) }))}
        most={Math.max(...names.map((name) => by_variable[name] ?? 0), 1e-12)}
      />
    </ChartCard>
  )
}

/** Comparison of preferences by the robustness of their winners: A, B, C and random ones. */
function PreferencesCard({ job }: { job: Job }) {
  const [simulated, setSimulated] = useState(false)
  const key = `${job.id} ${job.evaluations} ${simulated}`
  const preferences = useResource(
    key,
    () =>
      cached(key, () =>
        post('/v1/jobs/{job_id}/preferences', {
          path: { job_id: job.id },
          body: {
            drawn: 512,
            candidates: CANDIDATES,
            samples: simulated ? samplesOf(job, LEAST_SAMPLES_EACH) : 0,
            radius: 0.02,
            seed: 1,
            precision: 'single',
          },
        }),
      ),
    { keep: true },
  )
  const { data, error, loading, reload } = preferences
  const [first] = data?.candidates ?? []
  return (
    <Card
      title="Robustness by preference"
      data={{ 'data-most-robust': data && data.samples > 0 && first ? placeWord(first) : '' }}
      tools={
        !simulated && (
          <button type="button" class="compact" onClick={() => setSimulated(true)}>
            Simulate designs around the winners
          </button>
        )
      }
    >
      <div class="stack">
        {error && (
          <ErrorNotice what="Could not compare the preferences." error={error} retry={reload} />
        )}
        {loading && <Loading what={simulated ? 'simulations around the winners' : 'the winners'} />}
        {data && <Winners job={job} preferences={data} />}
      </div>
    </Card>
  )
}

function Winners({ job, preferences }: { job: Job; preferences: RobustPreferences }) {
  const { candidates, drawn, winners, samples } = preferences
  const [first] = candidates
  return (
    <>
      {first?.index && (
        <p>
          The most robust winner is <DesignLink job={job} {...first} />, best under{' '}
          {[...first.named, `${percent(first.share, 2)} of the random preferences`]
            .join(', ')
            .replace(/, (?=[^,]*$)/, ' and ')}
          . Its robustness index is {formatNumber(first.index.value, 3)}; lower is more robust.
        </p>
      )}
      <Table
        caption="Winners under A, B, C and random preferences"
        rows={candidates}
        rowData={({ named }) => ({ 'data-wins-under': named.join(' ') })}
        columns={winnerColumns(job, samples > 0)}
      />
      <p class="muted small">
        All designs ranked under A, B, C and {formatCount(drawn)} random preferences:{' '}
        {formatCount(winners)} of them win under at least one.{' '}
        {samples > 0 &&
          `The index is estimated from ${formatCount(samples)} designs around each, with a 95 % interval. `}
        Only evaluated designs can win; to search under a preference, run another job.
      </p>
    </>
  )
}

function winnerColumns(job: Job, simulated: boolean): readonly Column<PreferenceWinner>[] {
  const index: Column<PreferenceWinner> = {
    key: 'robustness index',
    numeric: true,
    value: ({ index }) => index?.value ?? null,
    cell: ({ index }) =>
      index ? (
        <>
          {formatNumber(index.value, 3)}{' '}
          <span class="muted small">
            ({formatNumber(index.low, 3)}–{formatNumber(index.high, 3)})
          </span>
        </>
      ) : (
        NONE
      ),
  }
  return [
    {
      key: 'best under',
      header: true,
      value: ({ named }) => named.join(', ') || null,
      cell: ({ named }) => named.join(', ') || 'random ones only',
    },
    { key: 'share of random', percent: 2, minor: true, value: ({ share }) => share },
    { key: 'design', cell: (winner) => <DesignLink job={job} {...winner} /> },
    ...(simulated ? [index] : []),
    { key: 'fitness (job’s preference)', digits: 4, value: ({ fitness }) => fitness },
    {
      key: 'loss',
      unit: '%',
      numeric: true,
      value: ({ loss }) => loss,
      cell: ({ loss }) => formatExact(loss && loss * 100, 2),
    },
    {
      key: 'preference',
      cell: ({ preference }) => (
        <a
          class="nowrap"
          href={withQuery(jobPath(job.id, 'preferences'), {
            preference: preferenceQuery(preference),
          })}
        >
          rank by it
        </a>
      ),
    },
  ]
}
