/** Interval charts of the parameters (fig. 2.14). */

import type { FittedParameter, Identifiability } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { type Column, Table } from '../../components/table/table'
import { BrokenName, Unit } from '../../components/text'
import { formatExact, formatNumber, percent } from '../../format/number'
import { exactValueQuantity, type Value, valueQuantity } from '../../format/value'
import { VARIABLE } from '../columns'
import { DECISIVE, outline, placeOf, shareOf, type Trust } from './intervals'

/** Size of a chart's coordinate system, stretched to its box. */
const WIDTH = 100
const HEIGHT = 60

interface IntervalPanelsProps {
  identifiability: Identifiability
  shown: readonly FittedParameter[]
  runs: number
  judged: boolean
}

export function IntervalPanels({ identifiability, shown, runs, judged }: IntervalPanelsProps) {
  const { thresholds } = identifiability
  const [least, most] = [Math.min(...thresholds), Math.max(...thresholds)]
  return (
    <ChartCard
      title="Intervals by threshold"
      note={
        `Values of designs of ${runs > 1 ? `${runs} runs` : 'the run'} whose fitness is within a threshold of the run’s best.` +
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
          {runs > 1 && (
            <span>
              <i class="interval-run" aria-hidden="true" />
              best of each run
            </span>
          )}
          <span>
            dotted: {percent(DECISIVE, 1)}
            {judged && ', the threshold of the verdict'}
          </span>
        </>
      }
      table={() => (
        <Table
          caption="Intervals by threshold"
          rows={shown}
          columns={[
            {
              ...VARIABLE,
              label: 'Parameter',
              cell: ({ name, unit }) => (
                <>
                  <BrokenName name={name} />
                  <Unit unit={unit} />
                </>
              ),
            },
            ...thresholds.map(
              (threshold, k): Column<FittedParameter> => ({
                key: String(threshold),
                label: `within ${formatExact(threshold * 100)} %`,
                numeric: true,
                data: ({ intervals }) => `${intervals[k].low} – ${intervals[k].high}`,
                cell: ({ intervals }) => rangeInWords(intervals[k]),
              }),
            ),
          ]}
          pageSize={60}
        />
      )}
    >
      <div class="intervals">
        {shown.map((parameter) => (
          <Panel key={parameter.name} identifiability={identifiability} parameter={parameter} />
        ))}
      </div>
    </ChartCard>
  )
}

function rangeInWords({ low, high }: { low: number; high: number }): string {
  return `${formatNumber(low, 3)} – ${formatNumber(high, 3)}`
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
  const text = decisive && rangeInWords(decisive)
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

const TONES: Readonly<Record<Trust, 'good' | 'warn' | 'muted'>> = {
  trusted: 'good',
  rough: 'warn',
  unknown: 'muted',
}

export function TrustBadge({ trust }: { trust: Trust }) {
  return (
    <span class="badge" data-tone={TONES[trust]} data-trust={trust}>
      {trust}
    </span>
  )
}
