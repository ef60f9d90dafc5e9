/** Values of a chart by iteration, as a table. */

import { type Column, Table } from '../components/table/table'

export function ByIteration<R extends { readonly index: number }>({
  caption,
  rows,
  columns,
}: {
  caption: string
  rows: readonly R[]
  /** Columns after the iteration index. */
  columns: readonly Column<R>[]
}) {
  return (
    <Table<R>
      caption={caption}
      tall
      rows={rows}
      rowKey={(row) => String(row.index)}
      order={{ column: 'index', descending: true }}
      columns={[
        {
          key: 'index',
          label: 'Iteration',
          numeric: true,
          header: true,
          value: (row) => row.index,
        },
        ...columns,
      ]}
    />
  )
}
