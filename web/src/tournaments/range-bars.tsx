/** Estimates with their intervals, one below the other on one axis. */

import type { ComponentChildren } from 'preact'
import { linearTicks, logTicks } from '../charts/log-axis'
import { formatExact } from '../format/number'

export interface RangeRow {
  readonly key: string
  readonly label: ComponentChildren
  /** What the row says, for screen readers. */
  readonly words: string
  readonly colour: `--${string}`
  readonly value: number | null
  readonly low: number | null
  /** Null with a value: beyond the axis. */
  readonly high: number | null
}

export function RangeBars({
  rows,
  logarithmic = false,
  unit,
  absent = '',
}: {
  rows: readonly RangeRow[]
  logarithmic?: boolean
  /** What the axis counts. */
  unit: string
  /** What stands in place of an estimate that there is not. */
  absent?: string
}) {
  const [least, most] = extent(rows)
  const room = logarithmic ? 1.1 : 0.25
  const low = logarithmic ? least / room : Math.max(0, least - room)
  const high = logarithmic ? most * room : most + room
  const scale = logarithmic ? Math.log : (x: number) => x
  const place = (x: number) => ((scale(x) - scale(low)) / (scale(high) - scale(low))) * 100
  const ticks = (logarithmic ? logTicks : linearTicks)(low, high).filter((_, k, all) =>
    all.length > 8 ? k % 2 === 0 : true,
  )
  return (
    <div class="range-bars">
      <ul>
        {rows.map((row) => (
          <li key={row.key} data-row={row.key}>
            <span class="range-label">{row.label}</span>
            <span class="range-track" role="img" aria-label={row.words}>
              {ticks.map((tick) => (
                <i key={tick} class="range-tick" style={{ left: `${place(tick)}%` }} />
              ))}
              {row.value === null ? (
                <span class="muted small">{absent}</span>
              ) : (
                <>
                  <i
                    class="range-line"
                    style={{
                      left: `${place(row.low ?? row.value)}%`,
                      right: `${100 - (row.high === null ? 100 : place(row.high))}%`,
                      background: `var(${row.colour})`,
                    }}
                  />
                  <i
                    class="range-dot"
                    style={{ left: `${place(row.value)}%`, background: `var(${row.colour})` }}
                  />
                </>
              )}
            </span>
          </li>
        ))}
      </ul>
      <div class="range-axis" aria-hidden="true">
        <span class="range-label" />
        <span class="range-track">
          {ticks.map((tick) => (
            <span key={tick} style={{ left: `${place(tick)}%` }}>
              {formatExact(tick)}
            </span>
          ))}
        </span>
      </div>
      <p class="muted small range-unit">{unit}</p>
    </div>
  )
}

function extent(rows: readonly RangeRow[]): [number, number] {
  const numbers = rows
    .flatMap(({ low, value, high }) => [low, value, high])
    .filter((x) => x !== null)
  return numbers.length === 0 ? [1, 10] : [Math.min(...numbers), Math.max(...numbers)]
}
