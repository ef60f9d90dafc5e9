/** Interval charts of the parameters (fig. 2.14). */

import type { FittedParameter, Identifiability } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { BrokenName } from '../../components/broken-name'
import { type Column, Table } from '../../components/table/table'
import { Unit } from '../../components/unit'
import { formatExact, formatNumber, percent } from '../../format/number'
import { exactValueQuantity, type Value, valueQuantity } from '../../format/value'
import { DECISIVE, outline, placeOf, shareOf } from './intervals'
import { TrustBadge } from './verdicts'

/** Size of a chart's coordinate system, stretched to its box. */
const WIDTH = 100
const HEIGHT = 60

export function IntervalPanels({
  identifiability,
  shown,
  labels,
  judgedAt,
}: {
  identifiability: Identifiability
  /** The parameters with intervals. */
  shown: readonly FittedParameter[]
  labels: readonly string[]
  /** Threshold at which agreement is judged; null if none. */
  judgedAt: number | null
}) {
  const { thresholds } = identifiability
  const [least, most] = [Math.min(...thresholds), Math.max(...thresholds)]
  const runs = labels.length > 1 ? `${labels.length} runs` : 'the run'
  return (
    <ChartCard
      title="Intervals by threshold"
      note={
        `Values of designs of ${runs} whose fitness is within a threshold of the run’s best.` +
        ` x: the threshold from ${percent(least, 1)} to ${percent(most, 1)}, logarithmic;` +
        ' y: the search range.'
      }
      legend={
        <>
          <span>
            <i class="swatch interval-area" aria-hidden="true" />
            interval
          </span>
          <span>
            <i class="interval-best" aria-hidden="true" />
            overall best
          </span>
          {labels.length > 1 && (
            <span>
              <i class="interval-run" aria-hidden="true" />
              best of each run
            </span>
          )}
          <span>
            dotted: {percent(DECISIVE, 1)}
            {judgedAt === DECISIVE && ', the threshold of the verdict'}
          </span>
        </>
      }
      table={() => <IntervalTable identifiability={identifiability} shown={shown} />}
    >
      <div class="intervals">
        {shown.map((parameter) => (
          <Panel key={parameter.name} identifiability={identifiability} parameter={parameter} />
        ))}
      </div>
    </ChartCard>
  )
}

function Panel({
  identifiability,
  parameter,
}: {
  identifiability: Identifiability
  parameter: FittedParameter
}) {
  const { name, unit, low, high, best, bests, trust } = parameter
  const { thresholds } = identifiability
  const decisive = parameter.intervals[thresholds.indexOf(DECISIVE)]
  const middle = placeOf(DECISIVE, thresholds) * WIDTH
  const y = (value: Value) => (1 - shareOf(value, parameter)) * HEIGHT
  const text = decisive && `${formatNumber(decisive.low, 3)} – ${formatNumber(decisive.high, 3)}`
  return (
    <figure class="interval" data-trust={trust ?? 'none'}>
      <figcaption>
        <strong>
          <BrokenName name={name} />
        </strong>
        {trust && <TrustBadge trust={trust} />}
      </figcaption>
      <div class="interval-plot">
        <span class="interval-bound">{formatExact(high, 3)}</span>
        <svg
          viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
          preserveAspectRatio="none"
          role="img"
          aria-label={`${name}: best ${valueQuantity(best, unit)}, at 5 % ${text ?? 'unknown'}`}
        >
          <path class="area" d={outline(identifiability, parameter, WIDTH, HEIGHT)} />
          <line class="decisive" x1={middle} x2={middle} y1={0} y2={HEIGHT} />
          {bests.length > 1 &&
            bests.map((value, run) => (
              <line key={run} class="run" x1={0} x2={6} y1={y(value)} y2={y(value)} />
            ))}
          <line class="best" x1={0} x2={WIDTH} y1={y(best)} y2={y(best)} />
        </svg>
        <span class="interval-bound">{formatExact(low, 3)}</span>
      </div>
      <p class="muted small">
        {exactValueQuantity(best, unit, 4)}
        {text && <> (5&nbsp;%: {text})</>}
      </p>
    </figure>
  )
}

function IntervalTable({
  identifiability,
  shown,
}: {
  identifiability: Identifiability
  shown: readonly FittedParameter[]
}) {
  const columns: Column<FittedParameter>[] = [
    {
      key: 'name',
      label: 'Parameter',
      header: true,
      value: (p) => p.name,
      cell: (p) => (
        <>
          <BrokenName name={p.name} />
          <Unit unit={p.unit} />
        </>
      ),
    },
    ...identifiability.thresholds.map(
      (threshold, k): Column<FittedParameter> => ({
        key: String(threshold),
        label: `within ${formatExact(threshold * 100)} %`,
        numeric: true,
        data: ({ intervals }) => `${intervals[k].low} – ${intervals[k].high}`,
        cell: ({ intervals }) =>
          `${formatNumber(intervals[k].low, 3)} – ${formatNumber(intervals[k].high, 3)}`,
      }),
    ),
  ]
  return (
    <Table
      caption="Intervals by threshold"
      rows={shown}
      rowKey={({ name }) => name}
      columns={columns}
      pageSize={60}
    />
  )
}
