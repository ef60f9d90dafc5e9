/** Convergence and distribution of fitness of several jobs. */

import { useCallback, useMemo } from 'preact/hooks'
import type uPlot from 'uplot'
import type { JobComparison } from '../api/types'
import { ChartCard, LegendEntry, LineCard } from '../charts/chart-card'
import { LineChart } from '../charts/lines/line-chart'
import { lineLabel, paintReference, type ReferenceLine } from '../charts/lines/reference-line'
import { Check, Select } from '../components/fields/controls'
import { Table } from '../components/table/table'
import { referenceLabel } from '../job/gain'
import { fittedRange } from '../job/result/model'
import { setQuery } from '../router/navigation'
import { flag, oneOf, useQueryValue } from '../router/query-value'
import { jobPath } from '../router/routes'

export type ComparedJob = JobComparison['jobs'][number]

type Axis = 'iterations' | 'evaluations' | 'seconds'

const AXES: Readonly<Record<Axis, { label: string; unit?: string }>> = {
  iterations: { label: 'iteration' },
  evaluations: { label: 'evaluations' },
  seconds: { label: 'time of evaluation', unit: 's' },
}

const BY = oneOf(Object.keys(AXES) as Axis[], 'iterations')

const LISTED = [0, 0.05, 0.25, 0.5, 0.75, 0.95, 1]

function seriesOf(jobs: readonly ComparedJob[], lines: readonly (number | null)[][], width = 1.5) {
  return jobs.map((job, k) => ({
    label: job.name || job.id,
    values: lines[k],
    colour: colourOf(k),
    dash: dashOf(k),
    width,
    stepped: true,
  }))
}

/** Best fitness so far by iterations, evaluations or time. comparable: whether it is one quantity. */
export function ConvergenceCard({ jobs, comparable }: Pick<JobComparison, 'jobs' | 'comparable'>) {
  const [axis, setAxis] = useQueryValue<Axis>('by', BY, 'iterations')
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const { x, series, references, range } = useMemo(() => {
    const { x, lines } = convergences(jobs, axis)
    const references = comparable ? referencesOf(jobs) : []
    const levels = references.map(({ fitness }) => fitness)
    return {
      x,
      series: seriesOf(jobs, lines, 2),
      references,
      range: fittedRange(lines, levels, logarithmic),
    }
  }, [jobs, axis, comparable, logarithmic])
  const over = useCallback(
    (plot: uPlot) => {
      for (const each of references) paintReference(plot, each)
    },
    [references],
  )
  const { label, unit } = AXES[axis]
  return (
    <LineCard
      title="Convergence"
      note="Best fitness so far; lower is better. Drag to zoom, double-click to reset."
      tools={
        <>
          <Select
            label="By"
            value={axis}
            options={(Object.keys(AXES) as Axis[]).map((name) => [name, AXES[name].label])}
            onChoose={(name) => {
              // A range of the previous axis is meaningless on the new one.
              setQuery({ zoom: null })
              setAxis(name)
            }}
          />
          <Check label="logarithmic" checked={logarithmic} onChange={setLogarithmic} />
        </>
      }
      caption={`Best so far by ${label}`}
      label={`Convergence of ${jobs.length} jobs by ${label}${references.map((each) => `; ${lineLabel(each)}`).join('')}`}
      x={x}
      xLabel={label}
      xUnit={unit}
      yLabel="fitness"
      series={series}
      logarithmic={logarithmic}
      yRange={range}
      paintOver={over}
      height={320}
    />
  )
}

export function DistributionCard({ jobs }: { jobs: readonly ComparedJob[] }) {
  const { x, series } = useMemo(() => {
    const { x, lines } = distributions(jobs)
    return { x, series: seriesOf(jobs, lines) }
  }, [jobs])
  const at = ({ fitness, shares }: ComparedJob, share: number) =>
    fitness[shares.findIndex((s) => Math.abs(s - share) < 1e-9)] ?? null
  return (
    <ChartCard
      title="Distribution of fitness"
      note="Share of the designs that walk in every scenario with at most this fitness."
      legend={jobs.map((job, k) => (
        <LegendEntry key={job.id} colour={colourOf(k)} label={job.name || job.id} />
      ))}
      table={() => (
        <Table
          caption="Fitness by share of the designs"
          rows={LISTED}
          columns={[
            { key: 'share', header: true, percent: 2, value: (share) => share },
            ...jobs.map((job) => ({
              key: job.id,
              label: job.name || job.id,
              digits: 5,
              value: (share: number) => at(job, share),
            })),
          ]}
        />
      )}
    >
      <LineChart
        zoomName="zoom-distribution"
        label={`Distribution of fitness of ${jobs.length} jobs`}
        x={x}
        xLabel="fitness"
        xLogarithmic={x.length > 0 && x[0] > 0}
        yLabel="share of the designs"
        series={series}
        fromZero
        height={260}
      />
    </ChartCard>
  )
}

export function referencesOf(jobs: readonly ComparedJob[]): readonly ReferenceLine[] {
  const references = new Map<string, ReferenceLine>()
  for (const { reference } of jobs) {
    if (typeof reference?.fitness !== 'number') continue
    const label = referenceLabel(reference)
    references.set(`${label} ${reference.fitness}`, { label, fitness: reference.fitness })
  }
  return [...references.values()]
}

/** A job's link, with the colour of its lines. */
export function JobName({ job, index }: { job: Pick<ComparedJob, 'id' | 'name'>; index: number }) {
  return (
    <span class="nowrap">
      <i
        class="compared-mark"
        style={{ background: `var(${colourOf(index)})` }}
        aria-hidden="true"
      />
      <a href={jobPath(job.id)}>{job.name || job.id}</a>
    </span>
  )
}

const COLOURS = [1, 2, 3, 4, 5, 6].map((k) => `--series-${k}` as const)

export function colourOf(index: number): `--${string}` {
  return COLOURS[index % COLOURS.length]
}

/** Dash the lines whose colours repeat. */
export function dashOf(index: number): readonly number[] | undefined {
  return index < COLOURS.length ? undefined : [6, 4]
}

/** Best so far of every job on the union of their x values; null outside a job's range. */
export function convergences(jobs: readonly ComparedJob[], axis: Axis) {
  const places = jobs.map(({ convergence }) => convergence[axis])
  const x = union(places)
  const lines = jobs.map(({ convergence }, k) => held(x, places[k], convergence.best_so_far))
  return { x, lines }
}

export function distributions(jobs: readonly ComparedJob[]) {
  const x = union(jobs.map(({ fitness }) => fitness))
  const lines = jobs.map(({ fitness, shares }) => {
    if (fitness.length === 0) return x.map(() => null)
    return held(x, fitness, shares).map((share, k) =>
      share === null ? (x[k] < fitness[0] ? 0 : 1) : share,
    )
  })
  return { x, lines }
}

/** Resample a step function: the value at the last position not after each x. */
function held(
  x: readonly number[],
  places: readonly number[],
  values: readonly (number | null)[],
): (number | null)[] {
  let next = 0
  return x.map((at) => {
    while (next < places.length && places[next] <= at) next++
    return next === 0 || at > places[places.length - 1] ? null : values[next - 1]
  })
}

function union(all: readonly (readonly number[])[]): number[] {
  return [...new Set(all.flat())].sort((a, b) => a - b)
}
