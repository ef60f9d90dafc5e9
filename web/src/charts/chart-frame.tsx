/** A chart with its title, and the same numbers as a table for those who read rather than look. */

import type { ComponentChildren } from 'preact'
import { useId, useRef, useState } from 'preact/hooks'
import { ErrorNotice } from '../components/feedback'
import { Menu } from '../components/menu'
import type { DataTable } from '../export/csv'
import type { Kind } from '../export/save'

export function ChartFrame({
  title,
  note,
  table,
  data,
  tools,
  legend,
  children,
}: {
  title: string
  /** A sentence on what is drawn. */
  note?: string
  /** The chart's numbers; made only when asked for. */
  table: () => ComponentChildren
  /** All of the chart's numbers, where the table holds some of them only. */
  data?: () => DataTable
  /** Controls of the chart. */
  tools?: ComponentChildren
  legend?: ComponentChildren
  /** The chart. */
  children: ComponentChildren
}) {
  const [asTable, setAsTable] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const card = useRef<HTMLElement>(null)
  const heading = useId()
  const save = (kind: Kind) => {
    setError(null)
    import('../export/save')
      .then(({ saveChart }) => saveChart(kind, { title, card: card.current!, table, data }))
      .catch(setError)
  }
  const item = (label: string, kind: Kind) => ({ label, onChoose: () => save(kind) })
  return (
    <section class="card chart-frame" aria-labelledby={heading} ref={card}>
      <header>
        <div>
          <h2 id={heading}>{title}</h2>
          {note && <p>{note}</p>}
        </div>
        <div class="row" data-not-drawn>
          {!asTable && tools}
          <Menu
            label="Save"
            of={title}
            items={[
              item('Numbers (CSV)', 'csv'),
              ...(asTable ? [] : [item('Picture (SVG)', 'svg'), item('Picture (PNG)', 'png')]),
            ]}
          />
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
      {error !== null && <ErrorNotice what="The file could not be made." error={error} />}
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
