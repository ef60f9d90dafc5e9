/** Cumulative distribution of the fitness of several jobs. */

import { useMemo } from 'preact/hooks'
import { ChartFrame, LegendEntry } from '../charts/chart-frame'
import { LinkedChart } from '../charts/lines/linked-chart'
import { Table } from '../components/table/table'
import { formatNumber, percent } from '../format/number'
import { type ComparedJob, colourOf, dashOf, distributions } from './series'

/** Shares listed in the table. */
const LISTED = [0, 0.05, 0.25, 0.5, 0.75, 0.95, 1]

export function DistributionCard({ jobs }: { jobs: readonly ComparedJob[] }) {
  const { x, lines } = useMemo(() => distributions(jobs), [jobs])
  const series = useMemo(
    () =>
      jobs.map((job, k) => ({
        label: job.name || job.id,
        values: lines[k],
        colour: colourOf(k),
        dash: dashOf(k),
        stepped: true,
      })),
    [jobs, lines],
  )
  const at = (job: ComparedJob, share: number) =>
    job.fitness[job.shares.findIndex((s) => Math.abs(s - share) < 1e-9)] ?? null
  return (
    <ChartFrame
      title="Distribution of fitness"
      note="Share of the designs that walk in every scenario with at most this fitness."
      legend={jobs.map((job, k) => (
        <LegendEntry key={job.id} colour={colourOf(k)} label={job.name || job.id} />
      ))}
      table={() => (
        <Table
          caption="Fitness by share of the designs"
          rows={LISTED}
          rowKey={(share) => String(share)}
          columns={[
            {
              key: 'share',
              label: 'Share',
              header: true,
              value: (share) => share,
              cell: (share) => percent(share, 2),
            },
            ...jobs.map((job) => ({
              key: job.id,
              label: job.name || job.id,
              numeric: true,
              value: (share: number) => at(job, share),
              cell: (share: number) => formatNumber(at(job, share), 5),
            })),
          ]}
        />
      )}
    >
      <LinkedChart
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
    </ChartFrame>
  )
}
