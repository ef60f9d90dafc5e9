/** Values by iteration, as a table and as a chart. */

import { useMemo } from 'preact/hooks'
import { LineCard, type LineCardProps } from '../charts/chart-card'
import { type Column, Table } from '../components/table/table'
import { capitalized } from '../format/words'

interface Indexed {
  readonly index: number
}

/** columns: those after the iteration. */
export function ByIteration<R extends Indexed>({
  caption,
  rows,
  columns,
}: {
  caption: string
  rows: readonly R[]
  columns: readonly Column<R>[]
}) {
  return (
    <Table<R>
      caption={caption}
      tall
      rows={rows}
      rowKey={(row) => String(row.index)}
      order={{ column: 'iteration', descending: true }}
      columns={[
        { key: 'iteration', numeric: true, header: true, value: (row) => row.index },
        ...columns,
      ]}
    />
  )
}

export function IterationChart<R extends Indexed>({
  rows,
  name,
  value,
  colour = '--series-1',
  ...card
}: Omit<LineCardProps, 'x' | 'xLabel' | 'series' | 'caption' | 'yLabel'> & {
  rows: readonly R[]
  name: string
  value: (row: R) => number | null
  yLabel?: string
  colour?: `--${string}`
}) {
  const drawn = useMemo(
    () => ({
      x: rows.map(({ index }) => index),
      series: [{ label: name, values: rows.map(value), colour, width: 2 }],
    }),
    [rows],
  )
  return (
    <LineCard
      yLabel={name}
      {...card}
      {...drawn}
      caption={`${capitalized(name)} by iteration`}
      order={{ column: 'iteration', descending: true }}
      xLabel="iteration"
      counted
    />
  )
}
