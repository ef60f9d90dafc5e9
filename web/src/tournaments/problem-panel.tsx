/** The runs of a tournament on one problem: convergence, performance cloud, running times. */

import { useMemo, useRef } from 'preact/hooks'
import { get } from '../api/client'
import { useResource } from '../api/resource'
import type { ProblemRuns, TournamentStandings } from '../api/types'
import { ChartFrame, LegendEntry } from '../charts/chart-frame'
import { LinkedChart } from '../charts/lines/linked-chart'
import { ErrorNotice, Loading } from '../components/feedback'
import { type Column, Table } from '../components/table/table'
import { formatCount, formatNumber } from '../format/number'
import { setQuery } from '../router/navigation'
import type { RankedMethod } from './methods'
import { MethodLegend } from './profiles-card'
import { cloud, convergence } from './runs'
import { TimesCard } from './times-card'

export function ProblemPanel({
  found,
  id,
  methods,
  asked,
}: {
  found: TournamentStandings
  id: string
  methods: readonly RankedMethod[]
  /** Name of the problem in the address, which may be any text. */
  asked: string | null
}) {
  const names = found.tournament.problems
  const problem = names.find((name) => name === asked) ?? names[0]
  const ended = found.tournament.entrants.reduce((sum, { runs }) => sum + runs, 0)
  const runs = useResource(`${id} ${problem} ${ended}`, (signal) =>
    get('/v1/tournaments/{job_id}/problems/{problem}', {
      path: { job_id: id, problem },
      signal,
    }),
  )
  // Charts stay, and with them what is shown as a table, until those of another problem are there.
  const shown = useRef<ProblemRuns | null>(null)
  if (runs.data) shown.current = runs.data
  return (
    <section class="stack" aria-labelledby="problem">
      <header class="page-header">
        <h2 id="problem">Problem {problem}</h2>
        {names.length > 1 && (
          <label class="row">
            <span class="label">Problem</span>
            <select
              value={problem}
              onChange={(event) => setQuery({ problem: event.currentTarget.value })}
            >
              {names.map((name) => (
                <option key={name} value={name}>
                  {name}
                </option>
              ))}
            </select>
          </label>
        )}
      </header>
      {runs.error && (
        <ErrorNotice what="The runs cannot be shown." error={runs.error} retry={runs.reload} />
      )}
      {runs.loading && !shown.current && <Loading what="the runs" />}
      {shown.current && <Clouds found={shown.current} methods={methods} />}
      <TimesCard found={found} problem={problem} methods={methods} />
    </section>
  )
}

function Clouds({ found, methods }: { found: ProblemRuns; methods: readonly RankedMethod[] }) {
  const curves = useMemo(() => convergence(found, methods), [found, methods])
  const points = useMemo(() => cloud(found, methods), [found, methods])
  const known = methods.filter(({ label }) => label in found.methods)
  const target = found.target !== null && <LegendEntry colour="--text-muted" label="target" />
  return (
    <div class="grid">
      <ChartFrame
        title="Best so far"
        note="Median over the runs of a method, and the band between its quartiles; less is better."
        legend={
          <>
            <MethodLegend methods={known} />
            {target}
          </>
        }
        table={() => <CurvesTable found={found} methods={known} />}
      >
        <LinkedChart
          label={`Median fitness of ${known.length} methods over evaluations on ${found.problem}`}
          x={curves.x}
          xLabel="evaluations"
          xLogarithmic
          yLabel="fitness"
          series={curves.series}
          bands={curves.bands}
          logarithmic
          height={320}
        />
      </ChartFrame>
      <ChartFrame
        title="Performance cloud"
        note={
          'Every run is a point: its best, and the evaluations until that was found (figs. 3.1 to' +
          ' 3.3).'
        }
        legend={
          <>
            <MethodLegend methods={known} />
            {target}
          </>
        }
        table={() => <RunsTable found={found} methods={known} />}
      >
        <LinkedChart
          zoomName="zoom-cloud"
          label={`Best fitness of ${points.x.length - 2} runs over the evaluations until it was found`}
          x={points.x}
          xLabel="evaluations until the best was found"
          xLogarithmic
          yLabel="fitness"
          series={points.series}
          logarithmic
          height={320}
        />
      </ChartFrame>
    </div>
  )
}

function CurvesTable({ found, methods }: { found: ProblemRuns; methods: readonly RankedMethod[] }) {
  const of = (label: string, row: number) => {
    const { lower, median, upper } = found.methods[label]
    const [low, middle, high] = [lower, median, upper].map((column) => formatNumber(column[row]))
    return `${middle} (${low} – ${high})`
  }
  return (
    <Table
      caption={`Median of the best so far and quartiles on ${found.problem}`}
      rows={found.checkpoints.map((count, row) => ({ count, row }))}
      rowKey={({ row }) => String(row)}
      tall
      pageSize={100}
      columns={[
        {
          key: 'count',
          label: 'Evaluations',
          header: true,
          numeric: true,
          value: ({ count }) => count,
          cell: ({ count }) => formatCount(count),
        },
        ...methods.map(
          ({ label }): Column<{ count: number; row: number }> => ({
            key: label,
            label,
            numeric: true,
            cell: ({ row }) => of(label, row),
          }),
        ),
      ]}
    />
  )
}

interface Run {
  readonly method: string
  readonly index: number
  readonly best: number | null
  readonly after: number | null
  readonly solved: number | null
}

function RunsTable({ found, methods }: { found: ProblemRuns; methods: readonly RankedMethod[] }) {
  const rows = methods.flatMap(({ label }) => {
    const { best, found_after, solved_after } = found.methods[label]
    return best.map(
      (value, index): Run => ({
        method: label,
        index,
        best: value,
        after: found_after[index],
        solved: solved_after[index],
      }),
    )
  })
  const number = (key: 'best' | 'after' | 'solved', label: string): Column<Run> => ({
    key,
    label,
    numeric: true,
    value: (run) => run[key],
    cell: (run) => (key === 'best' ? formatNumber(run[key]) : formatCount(run[key])),
  })
  return (
    <Table
      caption={`Runs on ${found.problem}`}
      rows={rows}
      rowKey={({ method, index }) => `${method} ${index}`}
      tall
      pageSize={100}
      columns={[
        { key: 'method', label: 'Method', header: true, value: ({ method }) => method },
        { key: 'index', label: 'Run', numeric: true, value: ({ index }) => index },
        number('best', 'Best'),
        number('after', 'Found after'),
        number('solved', 'Target after'),
      ]}
    />
  )
}
