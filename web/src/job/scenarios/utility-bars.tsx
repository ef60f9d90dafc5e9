/** Bar chart of the winner's utilities by scenario, with those of a reference. */

import type { ComponentChildren } from 'preact'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { quantity } from '../../format/number'
import { capitalized } from '../../format/words'
import type { CaseWords } from '../fitness'
import '../bars.css'

interface Bar {
  readonly name: string
  readonly winner: number | null
  readonly other: number | null
}

export function UtilityBars({
  rows,
  unit,
  words,
  label,
  table,
}: {
  rows: readonly Bar[]
  unit: string
  words: CaseWords
  /** Label of the reference; null without one. */
  label: string | null
  table: () => ComponentChildren
}) {
  const most = Math.max(...rows.flatMap((row) => [row.winner ?? 0, row.other ?? 0]), 1e-12)
  return (
    <ChartCard
      title={`${capitalized(words.measure)} by ${words.item}`}
      note={`${words.note}; lower is better. The ${words.item} with the longest bar limits the winner.`}
      legend={
        <>
          <LegendEntry colour="--series-1" label="winner" area />
          {label !== null && <LegendEntry colour="--series-6" label={label} area />}
        </>
      }
      table={table}
    >
      <ul class="bars">
        {rows.map((row) => (
          <li key={row.name}>
            <span class="bar-name">{row.name}</span>
            <span class="bar-lines">
              <BarLine value={row.winner} most={most} unit={unit} colour="--series-1" />
              {label !== null && (
                <BarLine value={row.other} most={most} unit={unit} colour="--series-6" />
              )}
            </span>
          </li>
        ))}
      </ul>
    </ChartCard>
  )
}

function BarLine({
  value,
  most,
  unit,
  colour,
}: {
  value: number | null
  most: number
  unit: string
  colour: string
}) {
  const width = value === null ? 0 : (value / most) * 100
  return (
    <span class="bar">
      <span class="bar-track">
        <i
          class="bar-fill"
          style={{ width: `${width}%`, background: `var(${colour})` }}
          aria-hidden="true"
        />
      </span>
      <span class="bar-value">{value === null ? 'not simulated' : quantity(value, unit)}</span>
    </span>
  )
}
