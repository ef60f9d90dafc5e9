/** Designs and the best fitness by iteration; the quantiles on request. */

import { useCallback, useMemo } from 'preact/hooks'
import type uPlot from 'uplot'
import { getBytes } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Iteration, Job } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { type Band, LineChart, type Series } from '../../charts/lines/line-chart'
import { lineLabel, type ReferenceLine } from '../../charts/lines/reference-line'
import { Empty } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { Term } from '../../components/term'
import { formatCount, formatNumber, withUnit } from '../../format/number'
import { capitalized, inWords } from '../../format/words'
import { navigate } from '../../router/navigation'
import { flag, useQueryValue } from '../../router/query-value'
import { jobPath } from '../../router/routes'
import { ByIteration } from '../by-iteration'
import { decodeParticles } from '../designs/particles'
import { fitnessUnit } from '../facts'
import { paintDots, paintOver } from './convergence-painter'
import { type Dots, dotsOf, fittedRange, iterationsAbove, type Line, MOST_DOTS } from './model'
import { type Distribution, useDistribution } from './use-distribution'

const RENEW_MS = 8000

const COLUMNS = ['best_so_far', 'best', 'median', 'mean', 'worst'] as const

export function ConvergenceChart({
  job,
  iterations,
  reference,
}: {
  job: Job
  iterations: readonly Iteration[]
  reference: ReferenceLine | null
}) {
  const [logarithmic, setLogarithmic] = useQueryValue('log', flag(true), true)
  const [bands, setBands] = useQueryValue('bands', flag(false), false)
  const distribution = useDistribution(job.id, bands ? iterations.length : 0)
  const dots = useDots(job, iterations.length)
  const drawn = useMemo(
    () => content(iterations, bands ? distribution : null),
    [iterations, distribution, bands],
  )
  const unit = fitnessUnit(job)
  const best = iterations.at(-1)?.best_so_far ?? null
  const { range, painted } = useMemo(() => {
    const range = fittedRange(
      drawn.lines.map(({ values }) => settled(values)),
      reference ? [reference.fitness] : [],
      logarithmic,
    )
    const highest = drawn.bands.length > 0 ? drawn.series[0].values : null
    const last = drawn.x.at(-1)
    const end =
      best === null || last === undefined
        ? null
        : { x: last, y: best, label: `best ${formatNumber(best)}` }
    const above = iterationsAbove(range, drawn.x, highest, dots)
    return { range, painted: { dots, reference, end, above } }
  }, [drawn, dots, reference, logarithmic, best])
  const paint = useCallback((plot: uPlot) => paintDots(plot, painted), [painted])
  const over = useCallback((plot: uPlot) => paintOver(plot, painted), [painted])
  return (
    <ChartCard
      title="Convergence"
      note={
        <>
          Each dot is the <Term name="fitness" /> of a design; lower is better. Click to open an
          iteration, drag to zoom.
        </>
      }
      tools={
        <>
          <Check label="bands" checked={bands} onChange={setBands} />
          <Check label="logarithmic" checked={logarithmic} onChange={setLogarithmic} />
        </>
      }
      legend={
        <>
          <LegendEntry colour="--series-1" label="best so far" />
          {drawn.bands.length > 0 && (
            <>
              <LegendEntry colour="--series-2" label="median" />
              <LegendEntry colour="--fan-inner" label="25 % to 75 % of the designs" area />
              <LegendEntry colour="--fan-outer" label="5 % to 95 %" area />
            </>
          )}
          {dots && (
            <span data-dots={dots.fitness.length}>
              dots: {formatCount(dots.fitness.length)}
              {dots.fitness.length < dots.total && ` of ${formatCount(dots.total)}`} designs
            </span>
          )}
          {painted.above.size > 0 && (
            <span data-above={painted.above.size}>▴ worse designs outside the range shown</span>
          )}
        </>
      }
      table={() => (
        <ByIteration<Iteration>
          caption={withUnit('Fitness by iteration', unit)}
          rows={iterations}
          columns={COLUMNS.map((key) => ({
            key,
            label: capitalized(inWords(key)),
            unit,
            digits: 5,
            value: (i) => i[key],
          }))}
        />
      )}
    >
      {best === null && !dots?.fitness.length ? (
        <Empty title="No design with a fitness yet">
          <p>
            Every design so far fails in a scenario or violates a constraint. The{' '}
            <a href={jobPath(job.id, 'iterations')}>iterations</a> count them.
          </p>
        </Empty>
      ) : (
        <LineChart
          label={`Convergence over ${iterations.length} iterations; best fitness ${formatNumber(best)}${
            reference ? `, ${lineLabel(reference)}` : ''
          }`}
          x={drawn.x}
          xLabel="iteration"
          counted
          yLabel="fitness"
          yUnit={unit}
          series={drawn.series}
          bands={drawn.bands}
          logarithmic={logarithmic}
          yRange={range}
          paint={paint}
          paintOver={over}
          onPick={(x) => navigate(jobPath(job.id, `iterations/${pickable(x, iterations.length)}`))}
          height={320}
        />
      )}
    </ChartCard>
  )
}

function pickable(x: number, count: number): number {
  return Math.min(count - 1, Math.max(0, Math.round(x)))
}

/** A line without its first twentieth, which would compress the rest. */
function settled(values: Line): Line {
  return Array.from(values).slice(Math.floor(values.length / 20))
}

function useDots(job: Job, committed: number): Dots | null {
  const renewed = useSlowly(committed, RENEW_MS)
  const dots = useResource(
    `dots ${job.id} ${renewed}`,
    (signal) =>
      getBytes('/v1/jobs/{job_id}/particles', {
        path: { job_id: job.id },
        query: { max_points: MOST_DOTS },
        signal,
      }).then((bytes) => dotsOf(decodeParticles(bytes))),
    { keep: true },
  )
  return dots.data
}

/** Quantiles between which the bands are drawn. */
const EDGES = [0.95, 0.75, 0.25, 0.05]

const NO_BANDS: Pick<Distribution, 'quantiles' | 'items'> = { quantiles: [], items: [] }

function content(iterations: readonly Iteration[], distribution: Distribution | null) {
  const x = iterations.map((i) => i.index)
  const best: Series = {
    label: 'best so far',
    values: iterations.map((i) => i.best_so_far),
    colour: '--series-1',
    width: 2.2,
  }
  const { quantiles, items } = distribution ?? NO_BANDS
  if (!EDGES.every((share) => quantiles.includes(share))) {
    return { x, series: [best], lines: [best], bands: [] }
  }
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
  const median: Series = {
    label: 'median',
    values: iterations.map((i) => i.median),
    colour: '--series-2',
  }
  const bands: Band[] = [
    { upper: 0, lower: 3, colour: '--series-1', opacity: 0.13 },
    { upper: 1, lower: 2, colour: '--series-1', opacity: 0.22 },
  ]
  return { x, series: [...EDGES.map(edge), best, median], lines: [best, median], bands }
}
