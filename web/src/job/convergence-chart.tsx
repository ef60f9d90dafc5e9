/** Best, median and quantiles of fitness over the iterations. */

import { useMemo } from 'preact/hooks'
import type { Iteration, Job } from '../api/types'
import { type Band, LineChart, type Series } from '../charts/line-chart'
import { ChartFrame, LegendEntry } from '../components/chart-frame'
import { formatNumber, withUnit } from '../format/number'
import { flag, RANGE, useQueryValue } from '../router/query-value'
import { ByIteration } from './by-iteration'
import { fitnessUnit } from './fitness'
import type { Distribution } from './use-distribution'

export function ConvergenceChart({
  job,
  iterations,
  distribution,
}: {
  job: Job
  iterations: readonly Iteration[]
  distribution: Distribution
}) {
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const [zoom, setZoom] = useQueryValue('zoom', RANGE, null)
  const drawn = useMemo(() => content(iterations, distribution), [iterations, distribution])
  const unit = fitnessUnit(job)
  const best = iterations.at(-1)?.best_so_far
  return (
    <ChartFrame
      title="Convergence"
      note="Fitness over the iterations; less is better. Drag to zoom, double-click to see all."
      tools={
        <label class="check small">
          <input
            type="checkbox"
            checked={logarithmic}
            onChange={(event) => setLogarithmic(event.currentTarget.checked)}
          />
          logarithmic
        </label>
      }
      legend={
        <>
          <LegendEntry colour="--series-1" label="best so far" />
          <LegendEntry colour="--series-2" label="median" />
          {drawn.bands.length > 0 && (
            <>
              <LegendEntry colour="--fan-inner" label="25 % to 75 % of the designs" area />
              <LegendEntry colour="--fan-outer" label="5 % to 95 %" area />
            </>
          )}
        </>
      }
      table={() => <IterationTable iterations={iterations} unit={unit} />}
    >
      <LineChart
        label={`Convergence over ${iterations.length} iterations; best fitness ${formatNumber(best)}`}
        x={drawn.x}
        xLabel="iteration"
        counted
        yLabel="fitness"
        yUnit={unit}
        series={drawn.series}
        bands={drawn.bands}
        logarithmic={logarithmic}
        zoom={zoom}
        onZoom={setZoom}
        height={320}
      />
    </ChartFrame>
  )
}

function content(iterations: readonly Iteration[], { quantiles, items }: Distribution) {
  const x = iterations.map((i) => i.index)
  const lines: Series[] = [
    {
      label: 'best so far',
      values: iterations.map((i) => i.best_so_far),
      colour: '--series-1',
      width: 2.2,
    },
    { label: 'median', values: iterations.map((i) => i.median), colour: '--series-2' },
  ]
  const edge = (share: number): Series => {
    const column = quantiles.indexOf(share)
    const byIndex = new Map(items.map((item) => [item.index, item.fitness[column]]))
    return {
      label: `${share * 100} %`,
      values: iterations.map((i) => byIndex.get(i.index) ?? null),
      colour: '--series-1',
      width: 0,
    }
  }
  if (![0.05, 0.25, 0.75, 0.95].every((share) => quantiles.includes(share))) {
    return { x, series: lines, bands: [] }
  }
  const edges = [edge(0.95), edge(0.75), edge(0.25), edge(0.05)]
  const bands: Band[] = [
    { upper: 0, lower: 3, colour: '--series-1', opacity: 0.13 },
    { upper: 1, lower: 2, colour: '--series-1', opacity: 0.22 },
  ]
  return { x, series: [...edges, ...lines], bands }
}

function IterationTable({ iterations, unit }: { iterations: readonly Iteration[]; unit: string }) {
  const fitness = (key: 'best_so_far' | 'best' | 'median' | 'mean' | 'worst', label: string) => ({
    key,
    label,
    unit,
    numeric: true,
    value: (i: Iteration) => i[key],
    cell: (i: Iteration) => formatNumber(i[key], 5),
  })
  return (
    <ByIteration
      caption={withUnit('Fitness by iteration', unit)}
      rows={iterations}
      columns={[
        fitness('best_so_far', 'Best so far'),
        fitness('best', 'Best'),
        fitness('median', 'Median'),
        fitness('mean', 'Mean'),
        fitness('worst', 'Worst'),
      ]}
    />
  )
}
