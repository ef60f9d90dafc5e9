/** A chart card: title, legend, export menu, and the same numbers as a table. */

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
  note?: string
  /** The chart's numbers; rendered on demand. */
  table: () => ComponentChildren
  /** All numbers of the chart, if the table holds only some of them. */
  data?: () => DataTable
  tools?: ComponentChildren
  legend?: ComponentChildren
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
      {error !== null && <ErrorNotice what="Could not create the file." error={error} />}
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
