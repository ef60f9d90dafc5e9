/** Horizontal bars by name. */

import type { ComponentChildren } from 'preact'
import './bars.css'

export interface Bar {
  readonly value: number | null
  readonly text: string
  readonly colour?: `--${string}`
  readonly interval?: { readonly low: number; readonly high: number } | null
}

export interface BarRow {
  readonly name: string
  readonly label?: ComponentChildren
  readonly bars: readonly Bar[]
}

interface BarsProps {
  rows: readonly BarRow[]
  most: number
  output?: string
}

/** most: value of the full length; output: name of what is shown, for tests. */
export function Bars({ rows, most, output }: BarsProps) {
  const share = (part: number) => `${(part / most) * 100}%`
  return (
    <ul class="bars" data-output={output}>
      {rows.map(({ name, label, bars }) => (
        <li key={name} data-variable={name}>
          <span class="bar-name">{label ?? name}</span>
          <span class="bar-lines">
            {bars.map(({ value, text, colour = '--series-1', interval }) => (
              <span key={colour} class="bar">
                <span class="bar-track" aria-hidden="true">
                  <i
                    class="bar-fill"
                    style={{ width: share(value ?? 0), background: `var(${colour})` }}
                  />
                  {interval && (
                    <i
                      class="bar-interval"
                      style={{
                        left: share(interval.low),
                        width: share(interval.high - interval.low),
                      }}
                    />
                  )}
                </span>
                <span class="bar-value">{text}</span>
              </span>
            ))}
          </span>
        </li>
      ))}
    </ul>
  )
}
