/** Sensitivity of the winner to small changes of its variables, by scenario and variable. */

import { post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, JobSpec, Robustness, RobustnessIndex } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE, percent } from '../../format/number'
import { inWords } from '../../format/words'
import { searchedVariables } from '../designs/variables'
import { RobustPreferencesCard } from './preferences-card'
import '../bars.css'

const LEAST_SAMPLES = 128

/** Responses since the page was loaded; the result for a design does not change. */
const cache = new Map<string, Promise<Robustness>>()

export function RobustnessPanel({ job }: { job: Job }) {
  const best = job.best
  const key = best ? `${job.id} ${best.iteration} ${best.particle}` : null
  const response = useResource(key, () => estimate(job, key!))
  if (!best) {
    return (
      <section class="card">
        <Empty title="No winner yet">
          <p>Robustness can be estimated once a design has succeeded in every scenario.</p>
        </Empty>
      </section>
    )
  }
  const robustness = response.data
  return (
    <div class="stack" data-robustness={robustness?.index?.value ?? ''}>
      {response.error && (
        <ErrorNotice
          what="Could not estimate the robustness."
          error={response.error}
          retry={response.reload}
        />
      )}
      {robustness ? (
        <>
          <ByScenario robustness={robustness} />
          <ByVariable robustness={robustness} />
        </>
      ) : (
        response.loading && <Loading what="simulations of designs around the winner" />
      )}
      <RobustPreferencesCard job={job} />
    </div>
  )
}

function estimate(job: Job, key: string): Promise<Robustness> {
  const cached = cache.get(key)
  if (cached) return cached
  const { robot, controller, scenarios } = job.spec as JobSpec
  const variables = searchedVariables(job.spec)
  const answer = post('/v1/robustness', {
    body: {
      robot,
      controller,
      scenarios,
      design: { ...job.best!.design },
      variables: [...variables],
      samples: Math.max(LEAST_SAMPLES, 4 * (variables.length + 1)),
      radius: 0.02,
      seed: 1,
      precision: 'double',
    },
  })
  cache.set(key, answer)
  answer.catch(() => cache.delete(key))
  return answer
}

interface IndexRow {
  readonly name: string
  readonly index: RobustnessIndex | null
  readonly byObjective: Readonly<Record<string, number | null>>
  readonly failed: number | null
}

function ByScenario({ robustness }: { robustness: Robustness }) {
  const rows: readonly IndexRow[] = [
    ...Object.entries(robustness.scenarios).map(([name, part]) => ({
      name,
      index: part.index,
      byObjective: part.by_objective,
      failed: part.failed,
    })),
    { name: 'all', index: robustness.index, byObjective: robustness.by_objective, failed: null },
  ]
  const most = Math.max(...rows.map((row) => row.index?.high ?? 0), 1e-12)
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
        <Table
          caption="Robustness index by scenario"
          rows={rows}
          rowKey={(row) => row.name}
          columns={indexColumns(robustness)}
        />
      )}
    >
      <ul class="bars">
        {rows.map(({ name, index }) => (
          <Bar key={name} name={name} value={index?.value ?? null} most={most} interval={index} />
        ))}
      </ul>
      <p class="muted small table-note">
        From {robustness.samples} designs within {percent(robustness.radius, 2)} of each variable’s
        bounds.
        {robustness.held.length > 0 && <> Fixed: {robustness.held.join(', ')}.</>}
      </p>
    </ChartCard>
  )
}

function indexColumns(robustness: Robustness): readonly Column<IndexRow>[] {
  return [
    { key: 'name', label: 'Scenario', header: true, value: (row) => row.name },
    {
      key: 'index',
      label: 'Index',
      numeric: true,
      value: (row) => row.index?.value ?? null,
      cell: (row) => formatNumber(row.index?.value, 3),
    },
    {
      key: 'interval',
      label: '95 % interval',
      numeric: true,
      data: (row) => (row.index ? `${row.index.low} – ${row.index.high}` : null),
      cell: (row) =>
        row.index ? `${formatNumber(row.index.low, 3)} – ${formatNumber(row.index.high, 3)}` : NONE,
    },
    ...robustness.objectives.map(
      ({ name }): Column<IndexRow> => ({
        key: name,
        label: inWords(name),
        numeric: true,
        value: (row) => row.byObjective[name] ?? null,
        cell: (row) => formatNumber(row.byObjective[name], 3),
      }),
    ),
    {
      key: 'failed',
      label: 'Failures',
      numeric: true,
      value: (row) => row.failed,
    },
  ]
}

function ByVariable({ robustness }: { robustness: Robustness }) {
  const rows = [...robustness.variables].sort(
    (a, b) => (robustness.by_variable[b.name] ?? 0) - (robustness.by_variable[a.name] ?? 0),
  )
  const most = Math.max(...rows.map((row) => robustness.by_variable[row.name] ?? 0), 1e-12)
  return (
    <ChartCard
      title="Sensitivity by variable"
      note="The robustness index by variable, over all scenarios and objectives."
      table={() => (
        <Table
          caption="Sensitivity by variable"
          rows={rows}
          rowKey={(row) => row.name}
          columns={[
            { key: 'name', label: 'Variable', header: true, value: (row) => row.name },
            {
              key: 'all',
              label: 'all',
              numeric: true,
              value: (row) => robustness.by_variable[row.name] ?? null,
              cell: (row) => formatNumber(robustness.by_variable[row.name], 3),
            },
            ...Object.entries(robustness.scenarios).map(
              ([scenario, part]): Column<Robustness['variables'][number]> => ({
                key: scenario,
                label: scenario,
                numeric: true,
                value: (row) => part.by_variable[row.name] ?? null,
                cell: (row) => formatNumber(part.by_variable[row.name], 3),
              }),
            ),
          ]}
        />
      )}
    >
      <ul class="bars">
        {rows.map(({ name }) => (
          <Bar key={name} name={name} value={robustness.by_variable[name] ?? null} most={most} />
        ))}
      </ul>
    </ChartCard>
  )
}

function Bar({
  name,
  value,
  most,
  interval = null,
}: {
  name: string
  value: number | null
  most: number
  interval?: RobustnessIndex | null
}) {
  const share = (part: number) => `${(part / most) * 100}%`
  return (
    <li>
      <span class="bar-name">{name}</span>
      <span class="bar">
        <span class="bar-track">
          <i
            class="bar-fill"
            style={{ width: share(value ?? 0), background: 'var(--series-1)' }}
            aria-hidden="true"
          />
          {interval && (
            <i
              class="bar-interval"
              style={{ left: share(interval.low), width: share(interval.high - interval.low) }}
              aria-hidden="true"
            />
          )}
        </span>
        <span class="bar-value">{value === null ? 'unknown' : formatNumber(value, 3)}</span>
      </span>
    </li>
  )
}
