/** The best of every job as it went on, by iterations, evaluations or time. */

import { useMemo } from 'preact/hooks'
import { LineChart } from '../charts/line-chart'
import { ChartFrame, LegendEntry } from '../components/chart-frame'
import { Table } from '../components/table'
import { formatNumber } from '../format/number'
import { setQuery, usePlace } from '../router/navigation'
import { type Axis, type ComparedJob, colourOf, convergences, dashOf } from './series'

const AXES: Readonly<Record<Axis, { label: string; unit?: string }>> = {
  iterations: { label: 'iteration' },
  evaluations: { label: 'evaluations' },
  seconds: { label: 'time of evaluation', unit: 's' },
}

export function ConvergenceCard({ jobs }: { jobs: readonly ComparedJob[] }) {
  const { query } = usePlace()
  const asked = query.get('by') ?? 'iterations'
  const axis = (asked in AXES ? asked : 'iterations') as Axis
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
  return (
    <ChartFrame
      title="Convergence"
      note="Best fitness so far; less is better. Drag to zoom, double-click to see all."
      tools={
        <label class="row small">
          <span>By</span>
          <select value={axis} onChange={(event) => setQuery({ by: event.currentTarget.value })}>
            {Object.entries(AXES).map(([name, { label }]) => (
              <option key={name} value={name}>
                {label}
              </option>
            ))}
          </select>
        </label>
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
        label={`Convergence of ${jobs.length} jobs by ${AXES[axis].label}`}
        x={x}
        xLabel={AXES[axis].label}
        xUnit={AXES[axis].unit}
        yLabel="fitness"
        series={series}
        logarithmic
        height={320}
      />
    </ChartFrame>
  )
}
