/** Distribution of fitness by iteration (fig. 4.6). */

import { useMemo } from 'preact/hooks'
import type uPlot from 'uplot'
import type { DistributionItem, Iteration, Job } from '../../api/types'
import { withAlpha } from '../../charts/canvas'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { LineChart } from '../../charts/lines/line-chart'
import { percent } from '../../format/number'
import { themeColour } from '../../theme'
import { ByIteration } from '../by-iteration'
import { fitnessUnit } from '../facts'
import { clipped } from './convergence-painter'
import { grouped, type Strip } from './model'
import type { Distribution } from './use-distribution'

/** More strips could not be distinguished on a common screen. */
const MOST_STRIPS = 250

interface DistributionChartProps {
  job: Job
  iterations: readonly Iteration[]
  distribution: Distribution
}

export function DistributionChart({ job, iterations, distribution }: DistributionChartProps) {
  const { quantiles, items } = distribution
  const unit = fitnessUnit(job)
  const drawn = useMemo(() => {
    const strips = grouped(items, MOST_STRIPS)
    const at = (share: number) => strips.map((strip) => strip.fitness[quantiles.indexOf(share)])
    return {
      strips,
      x: strips.map((strip) => strip.middle),
      series: [
        { label: 'worst', values: at(1), colour: '--series-6', width: 0 },
        { label: 'median', values: at(0.5), colour: '--series-2', width: 1.5 },
        { label: 'best', values: at(0), colour: '--series-1', width: 0 },
      ] as const,
    }
  }, [items, quantiles])
  const last = iterations.at(-1)
  return (
    <ChartCard
      title="Distribution of fitness"
      note="Each iteration is a strip; darker areas contain more designs."
      legend={
        <>
          <LegendEntry colour="--series-2" label="median" />
          <LegendEntry colour="--series-1" label="density of the designs" area />
          <span>
            {last?.failed ?? 0} of {last?.designs ?? 0} failed in the last iteration
          </span>
        </>
      }
      table={() => (
        <ByIteration
          caption="Quantiles of fitness by iteration"
          rows={items}
          columns={[
            ...quantiles.map((share, column) => ({
              key: String(share),
              label: share === 0 ? 'best' : share === 1 ? 'worst' : percent(share, 2),
              unit,
              digits: 5,
              value: (item: DistributionItem) => item.fitness[column],
            })),
            { key: 'failed', numeric: true, value: (i) => i.failed },
          ]}
        />
      )}
    >
      <LineChart
        zoomName="zoom-distribution"
        label={`Distribution of fitness over ${items.length} iterations`}
        x={drawn.x}
        xLabel="iteration"
        counted
        yLabel="fitness"
        yUnit={unit}
        series={drawn.series}
        logarithmic
        xMargin={0.5}
        paint={(plot) => paintStrips(plot, quantiles, drawn.strips)}
      />
    </ChartCard>
  )
}

/** The share of designs between two quantiles is known: the closer they are, the darker. */
function paintStrips(plot: uPlot, quantiles: readonly number[], strips: readonly Strip[]): void {
  const { ctx, bbox } = plot
  const colour = themeColour('--series-1')
  const pixel = devicePixelRatio
  clipped(plot, () => {
    for (const strip of strips) {
      const left = plot.valToPos(strip.from - 0.5, 'x', true)
      const right = plot.valToPos(strip.to + 0.5, 'x', true)
      const gap = right - left > 6 * pixel ? pixel : 0
      for (let q = 0; q + 1 < quantiles.length; q++) {
        const [low, high] = [strip.fitness[q], strip.fitness[q + 1]]
        if (low === null || high === null || low <= 0) continue
        const bottom = plot.valToPos(low, 'y', true)
        const top = plot.valToPos(high, 'y', true)
        const tall = Math.max(bottom - top, pixel)
        const density = (quantiles[q + 1] - quantiles[q]) / (tall / bbox.height)
        ctx.fillStyle = withAlpha(colour, 0.1 + 0.8 * (1 - Math.exp(-density / 4)))
        ctx.fillRect(left + gap, bottom - tall, right - left - gap, tall)
      }
    }
  })
}
