/** Cards of charts: title, legend, export menu, and the same numbers as a table. */

import type { ComponentChildren } from 'preact'
import { useId, useRef, useState } from 'preact/hooks'
import { ErrorNotice } from '../components/feedback'
import { Menu } from '../components/menu'
import type { SortOrder } from '../components/table/rows'
import { type Column, Table } from '../components/table/table'
import type { DataTable } from '../export/csv'
import type { Kind } from '../export/save'
import { formatExact, formatNumber } from '../format/number'
import { LineChart, type LineChartProps } from './lines/line-chart'

interface ChartCardProps {
  title: string
  note?: ComponentChildren
  table: () => ComponentChildren
  data?: () => DataTable
  tools?: ComponentChildren
  legend?: ComponentChildren
  children: ComponentChildren
}

export function ChartCard(props: ChartCardProps) {
  const { title, note, table, data, tools, legend, children } = props
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

interface LegendEntryProps {
  colour: `--${string}`
  label: string
  area?: boolean
}

export function LegendEntry({ colour, label, area = false }: LegendEntryProps) {
  return (
    <span>
      <i class={area ? 'swatch' : ''} style={{ background: `var(${colour})` }} aria-hidden="true" />
      {label}
    </span>
  )
}

export interface LineCardProps
  extends LineChartProps,
    Pick<ChartCardProps, 'title' | 'note' | 'tools' | 'legend'> {
  readonly caption: string
  readonly order?: SortOrder
  readonly format?: (value: number | null) => string
}

export function LineCard({ title, note, tools, caption, order, ...props }: LineCardProps) {
  const { legend, format = (value) => formatNumber(value, 5), ...chart } = props
  const { x, xLabel, xUnit, yUnit, series } = chart
  const columns: Column<number>[] = [
    {
      key: xLabel,
      unit: xUnit,
      numeric: true,
      header: true,
      value: (k) => x[k],
      cell: (k) => formatExact(x[k]),
    },
    ...series.map(
      ({ label, values }): Column<number> => ({
        key: label,
        label,
        unit: yUnit,
        numeric: true,
        value: (k) => values[k],
        cell: (k) => format(values[k]),
      }),
    ),
  ]
  return (
    <ChartCard
      title={title}
      note={note}
      tools={tools}
      legend={
        legend ??
        (series.length > 1 &&
          series.map(({ label, colour }) => (
            <LegendEntry key={label} colour={colour} label={label} />
          )))
      }
      table={() => (
        <Table
          caption={caption}
          columns={columns}
          rows={Array.from(x, (_, k) => k)}
          order={order}
          tall
        />
      )}
    >
      {/* Another quantity has another zoom. */}
      <LineChart key={xLabel} {...chart} />
    </ChartCard>
  )
}
