/** Best fitness so far of several jobs, by iterations, evaluations or time. */

import { useCallback, useMemo } from 'preact/hooks'
import type uPlot from 'uplot'
import { ChartFrame, LegendEntry } from '../charts/chart-frame'
import { LineChart } from '../charts/lines/line-chart'
import { lineLabel, paintReference } from '../charts/lines/reference-line'
import { Check } from '../components/fields/check'
import { Table } from '../components/table/table'
import { formatNumber } from '../format/number'
import { fittedRange } from '../job/overview/convergence-model'
import { flag, oneOf, RANGE, useQueryValue } from '../router/query-value'
import { type Axis, type ComparedJob, colourOf, convergences, dashOf, referencesOf } from './series'

const AXES: Readonly<Record<Axis, { label: string; unit?: string }>> = {
  iterations: { label: 'iteration' },
  evaluations: { label: 'evaluations' },
  seconds: { label: 'time of evaluation', unit: 's' },
}

const BY = oneOf(Object.keys(AXES) as Axis[], 'iterations')

export function ConvergenceCard({
  jobs,
  comparable,
}: {
  jobs: readonly ComparedJob[]
  /** Whether their fitness is the same quantity. */
  comparable: boolean
}) {
  const [axis, setAxis] = useQueryValue<Axis>('by', BY, 'iterations')
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const [zoom, setZoom] = useQueryValue('zoom', RANGE, null)
  const { x, lines } = useMemo(() => convergences(jobs, axis), [jobs, axis])
  const series = useMemo(
    () =>
      jobs.map((job, k) => ({
        label: job.name || job.id,
        values: lines[k],
        colour: colourOf(k),
        dash: dashOf(k),
        width: 2,
        stepped: true,
      })),
    [jobs, lines],
  )
  const references = useMemo(() => (comparable ? referencesOf(jobs) : []), [jobs, comparable])
  const range = useMemo(() => {
    const levels = references.map(({ fitness }) => fitness)
    return fittedRange(lines, levels, logarithmic)
  }, [lines, references, logarithmic])
  const over = useCallback(
    (plot: uPlot) => {
      for (const each of references) paintReference(plot, each)
    },
    [references],
  )
  const referenceText = references.map((each) => `; ${lineLabel(each)}`).join('')
  return (
    <ChartFrame
      title="Convergence"
      note="Best fitness so far; lower is better. Drag to zoom, double-click to reset."
      tools={
        <>
          <label class="row small">
            <span>By</span>
            <select
              value={axis}
              onChange={(event) => {
                setAxis(event.currentTarget.value as Axis)
                // A range of the previous axis is meaningless on the new one.
                setZoom(null)
              }}
            >
              {Object.entries(AXES).map(([name, { label }]) => (
                <option key={name} value={name}>
                  {label}
                </option>
              ))}
            </select>
          </label>
          <Check label="logarithmic" checked={logarithmic} onChange={setLogarithmic} />
        </>
      }
      legend={jobs.map((job, k) => (
        <LegendEntry key={job.id} colour={colourOf(k)} label={job.name || job.id} />
      ))}
      table={() => (
        <Table
          caption={`Best so far by ${AXES[axis].label}`}
          rows={x.map((at, k) => ({ at, k }))}
          rowKey={({ k }) => String(k)}
          columns={[
            {
              key: 'at',
              label: AXES[axis].label,
              unit: AXES[axis].unit,
              header: true,
              value: ({ at }) => at,
              cell: ({ at }) => formatNumber(at, 4),
            },
            ...jobs.map((job, j) => ({
              key: job.id,
              label: job.name || job.id,
              numeric: true,
              value: ({ k }: { k: number }) => lines[j][k],
              cell: ({ k }: { k: number }) => formatNumber(lines[j][k], 5),
            })),
          ]}
        />
      )}
    >
      <LineChart
        key={axis}
        label={`Convergence of ${jobs.length} jobs by ${AXES[axis].label}${referenceText}`}
        x={x}
        xLabel={AXES[axis].label}
        xUnit={AXES[axis].unit}
        yLabel="fitness"
        series={series}
        logarithmic={logarithmic}
        zoom={zoom}
        onZoom={setZoom}
        yRange={range}
        paintOver={over}
        height={320}
      />
    </ChartFrame>
  )
}
