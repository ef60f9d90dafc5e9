/** A chart with its title, and the same numbers as a table for those who read rather than look. */

import type { ComponentChildren } from 'preact'
import { useId, useState } from 'preact/hooks'

export function ChartFrame({
  title,
  note,
  table,
  tools,
  legend,
  children,
}: {
  title: string
  /** A sentence on what is drawn. */
  note?: string
  /** The chart's numbers; made only when asked for. */
  table: () => ComponentChildren
  /** Controls of the chart. */
  tools?: ComponentChildren
  legend?: ComponentChildren
  /** The chart. */
  children: ComponentChildren
}) {
  const [asTable, setAsTable] = useState(false)
  const heading = useId()
  return (
    <section class="card chart-frame" aria-labelledby={heading}>
      <header>
        <div>
          <h2 id={heading}>{title}</h2>
          {note && <p>{note}</p>}
        </div>
        <div class="row">
          {!asTable && tools}
          <button
            type="button"
            class="compact plain"
            aria-pressed={asTable}
            onClick={() => setAsTable(!asTable)}
          >
            {asTable ? 'Show as chart' : 'Show as table'}
            <span class="visually-hidden">: {title}</span>
          </button>
        </div>
      </header>
      {asTable ? (
        table()
      ) : (
        <>
          {children}
          {legend && <div class="legend">{legend}</div>}
        </>
      )}
    </section>
  )
}

/** An entry of a legend. */
export function LegendEntry({
  colour,
  label,
  area = false,
}: {
  colour: `--${string}`
  label: string
  area?: boolean
}) {
  return (
    <span>
      <i class={area ? 'swatch' : ''} style={{ background: `var(${colour})` }} aria-hidden="true" />
      {label}
    </span>
  )
}
