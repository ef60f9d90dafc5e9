/** Sensitivity of the winner to small changes of its variables. */

import { post } from '../../api/client'
import { cached, useResource } from '../../api/resource'
import type { Job, JobSpec, Robustness, RobustnessIndex } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE, percent } from '../../format/number'
import { placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { Bars } from '../bars'
import { SearchButton } from '../candidates/search-button'
import { searchedVariables } from '../facts'
import { CertificateCard } from './certificate-card'

/** Fewest designs simulated around the winner. */
const LEAST_SAMPLES = 128

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
      <CertificateCard job={job} />
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
      <Card title="A preference for robustness" tools={<SearchButton job={job} />}>
        <p class="muted">
          A search for preferences finds the design that is optimal under each, and judges it by its
          robustness and its evenness over the scenarios. It takes some minutes.
        </p>
      </Card>
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
      samples: Math.max(LEAST_SAMPLES, 4 * (searchedVariables(job.spec).length + 1)),
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
