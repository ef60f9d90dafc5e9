/** How robust the winner is against small changes of its variables, by scenario and variable. */

import { post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, JobSpec, Robustness, RobustnessIndex } from '../../api/types'
import { ChartFrame, LegendEntry } from '../../charts/chart-frame'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE, percent } from '../../format/number'
import { inWords } from '../../format/words'
import { searchedVariables } from '../designs/variables'
import { RobustPreferencesCard } from './preferences-card'
import '../bars.css'

const LEAST_SAMPLES = 128

/** What was asked since the page was loaded; a design and its walks do not change. */
const asked = new Map<string, Promise<Robustness>>()

export function RobustnessPanel({ job }: { job: Job }) {
  const best = job.best
  const key = best ? `${job.id} ${best.iteration} ${best.particle}` : null
  const robustness = useResource(key, () => estimate(job, key!))
  if (!best) {
    return (
      <section class="card">
        <Empty title="No winner yet">
          <p>Its robustness can be estimated as soon as a design has walked in every scenario.</p>
        </Empty>
      </section>
    )
  }
  const found = robustness.data
  return (
    <div class="stack" data-robustness={found?.index?.value ?? ''}>
      {robustness.error && (
        <ErrorNotice
          what="The robustness of the winner cannot be estimated."
          error={robustness.error}
          retry={robustness.reload}
        />
      )}
      {found ? (
        <>
          <ByScenario found={found} />
          <ByVariable found={found} />
        </>
      ) : (
        robustness.loading && <Loading what="walks of designs around the winner" />
      )}
      <RobustPreferencesCard job={job} />
    </div>
  )
}

function estimate(job: Job, key: string): Promise<Robustness> {
  const known = asked.get(key)
  if (known) return known
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
  asked.set(key, answer)
  answer.catch(() => asked.delete(key))
  return answer
}

interface IndexRow {
  readonly name: string
  readonly index: RobustnessIndex | null
  readonly byObjective: Readonly<Record<string, number | null>>
  readonly failed: number | null
}

function ByScenario({ found }: { found: Robustness }) {
  const rows: readonly IndexRow[] = [
    ...Object.entries(found.scenarios).map(([name, part]) => ({
      name,
      index: part.index,
      byObjective: part.by_objective,
      failed: part.failed,
    })),
    { name: 'all', index: found.index, byObjective: found.by_objective, failed: null },
  ]
  const most = Math.max(...rows.map((row) => row.index?.high ?? 0), 1e-12)
  return (
    <ChartFrame
      title="Robustness index by scenario"
      note="How much the objectives change, relatively, with the variables over their whole bounds; less is more robust."
      legend={
        <>
          <LegendEntry colour="--series-1" label="winner" area />
          <LegendEntry colour="--text" label="interval of 95 %" />
        </>
      }
      table={() => (
        <Table
          caption="Robustness index by scenario"
          rows={rows}
          rowKey={(row) => row.name}
          columns={indexColumns(found)}
        />
      )}
    >
      <ul class="bars">
        {rows.map(({ name, index }) => (
          <Bar key={name} name={name} value={index?.value ?? null} most={most} interval={index} />
        ))}
      </ul>
      <p class="muted small table-note">
        From {found.samples} designs within {percent(found.radius, 2)} of each variable’s bounds.
        {found.held.length > 0 && <> Not changed: {found.held.join(', ')}.</>}
      </p>
    </ChartFrame>
  )
}

function indexColumns(found: Robustness): readonly Column<IndexRow>[] {
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
      label: 'Interval of 95 %',
      numeric: true,
      data: (row) => (row.index ? `${row.index.low} – ${row.index.high}` : null),
      cell: (row) =>
        row.index ? `${formatNumber(row.index.low, 3)} – ${formatNumber(row.index.high, 3)}` : NONE,
    },
    ...found.objectives.map(
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
      label: 'Walks that failed',
      numeric: true,
      value: (row) => row.failed,
    },
  ]
}

function ByVariable({ found }: { found: Robustness }) {
  const rows = [...found.variables].sort(
    (a, b) => (found.by_variable[b.name] ?? 0) - (found.by_variable[a.name] ?? 0),
  )
  const most = Math.max(...rows.map((row) => found.by_variable[row.name] ?? 0), 1e-12)
  return (
    <ChartFrame
      title="To which variables it is sensitive"
      note="The same by variable, over all scenarios and objectives."
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
              value: (row) => found.by_variable[row.name] ?? null,
              cell: (row) => formatNumber(found.by_variable[row.name], 3),
            },
            ...Object.entries(found.scenarios).map(
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
          <Bar key={name} name={name} value={found.by_variable[name] ?? null} most={most} />
        ))}
      </ul>
    </ChartFrame>
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
        <span class="bar-value">{value === null ? 'not known' : formatNumber(value, 3)}</span>
      </span>
    </li>
  )
}
