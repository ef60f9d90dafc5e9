/** A table that sorts by its headers and is shown in pages. */

import type { ComponentChildren } from 'preact'
import { useContext, useState } from 'preact/hooks'
import { formatCount } from '../../format/number'
import { Unit } from '../unit'
import { type Cell, paged, type SortOrder, sorted } from './rows'
import { type CollectedTable, TableSink } from './table-sink'

export interface Column<R> {
  readonly key: string
  readonly label: string
  /** Written into the header in brackets; `1` is not written. */
  readonly unit?: string
  readonly numeric?: boolean
  /** What the column is sorted by; a column without it cannot be sorted here. */
  readonly value?: (row: R) => Cell
  /** What a file holds, in full; the value itself if missing, or else the text that is shown. */
  readonly data?: (row: R) => Cell
  /** Whether whoever gives the rows can sort them by it. */
  readonly sortable?: boolean
  /** What is shown; the value itself if missing. */
  readonly cell?: (row: R) => ComponentChildren
  /** Left out on narrow screens. */
  readonly minor?: boolean
  /** Whether the cell is the row's header. */
  readonly header?: boolean
}

export function Table<R>({
  caption,
  columns,
  rows,
  rowKey,
  order: initial,
  onOrder,
  pageSize = 50,
  paging,
  tall = false,
  rowData,
  elsewhere,
}: {
  /** What the table holds; read by screen readers, and shown unless it is all hidden by style. */
  caption: string
  columns: readonly Column<R>[]
  rows: readonly R[]
  rowKey: (row: R) => string
  order?: SortOrder
  /** Told of every other order. */
  onOrder?: (order: SortOrder) => void
  pageSize?: number
  /** The page that is shown, from 0, where the address holds it; else the table holds it itself. */
  paging?: readonly [page: number, onPage: (page: number) => void]
  /** Scroll inside a box of limited height. */
  tall?: boolean
  /** data- attributes of a row. */
  rowData?: (row: R) => Record<`data-${string}`, string | number>
  /** Of rows that come sorted: how they are, and what sorts them by another column. */
  elsewhere?: { readonly order: SortOrder; readonly onOrder: (column: string) => void }
}) {
  const [own, setOrder] = useState<SortOrder | null>(initial ?? null)
  const order = elsewhere?.order ?? own
  const ownPage = useState(0)
  const [wanted, setWanted] = paging ?? ownPage
  const sink = useContext(TableSink)
  if (sink) {
    sink({ caption, columns, rows } as unknown as CollectedTable)
    return null
  }
  const by = elsewhere ? undefined : columns.find(({ key }) => key === order?.column)?.value
  const inOrder = order && by ? sorted(rows, by, order.descending) : rows
  const page = paged(inOrder, wanted, pageSize)
  const reorder = (chosen: SortOrder) => {
    if (elsewhere) return elsewhere.onOrder(chosen.column)
    setOrder(chosen)
    onOrder?.(chosen)
    // What comes first by the new order is what is looked for.
    setWanted(0)
  }
  return (
    <div>
      {/* A box that scrolls must take the keyboard. */}
      <section
        class={tall ? 'table-scroll tall' : 'table-scroll'}
        tabIndex={0}
        aria-label={`${caption}: table`}
      >
        <table>
          <caption class="visually-hidden">{caption}</caption>
          <thead>
            <tr>
              {columns.map((column) => (
                <Header
                  key={column.key}
                  column={column}
                  sortable={elsewhere ? column.sortable === true : column.value !== undefined}
                  order={order}
                  onOrder={reorder}
                />
              ))}
            </tr>
          </thead>
          <tbody>
            {page.rows.map((row) => (
              <tr key={rowKey(row)} {...rowData?.(row)}>
                {columns.map((column) => cell(column, row))}
              </tr>
            ))}
          </tbody>
        </table>
      </section>
      {page.pages > 1 && (
        <Pager
          caption={caption}
          page={page.page}
          pages={page.pages}
          total={rows.length}
          size={pageSize}
          onPage={setWanted}
        />
      )}
    </div>
  )
}

function cell<R>(column: Column<R>, row: R) {
  const content = column.cell ? column.cell(row) : column.value?.(row)
  if (column.header) {
    return (
      <th key={column.key} scope="row" class={classes(column)}>
        {content}
      </th>
    )
  }
  return (
    <td key={column.key} class={classes(column)}>
      {content}
    </td>
  )
}

function Header<R>({
  column,
  sortable,
  order,
  onOrder,
}: {
  column: Column<R>
  sortable: boolean
  order: SortOrder | null
  onOrder: (order: SortOrder) => void
}) {
  const active = order?.column === column.key
  const label = (
    <>
      {column.label}
      <Unit unit={column.unit} />
    </>
  )
  const mark = active ? (order.descending ? ' ↓' : ' ↑') : ''
  return (
    <th
      scope="col"
      class={classes(column)}
      aria-sort={active ? (order.descending ? 'descending' : 'ascending') : undefined}
    >
      {sortable ? (
        <button
          type="button"
          onClick={() => onOrder({ column: column.key, descending: active && !order.descending })}
        >
          <span>
            {label}
            <span aria-hidden="true">{mark}</span>
          </span>
        </button>
      ) : (
        label
      )}
    </th>
  )
}

function Pager({
  caption,
  page,
  pages,
  total,
  size,
  onPage,
}: {
  /** Of the table. */
  caption: string
  /** From 0. */
  page: number
  pages: number
  total: number
  size: number
  onPage: (page: number) => void
}) {
  const last = Math.min(total, (page + 1) * size)
  return (
    // A group, not a landmark: several tables of a page may have one.
    <fieldset class="pager" aria-label={`Pages of ${caption}`}>
      <span>
        {formatCount(page * size + 1)}–{formatCount(last)} of {formatCount(total)}
      </span>
      <span class="row">
        <button
          type="button"
          class="compact"
          disabled={page === 0}
          onClick={() => onPage(page - 1)}
        >
          Previous
        </button>
        <span>
          page {page + 1} of {pages}
        </span>
        <button
          type="button"
          class="compact"
          disabled={page >= pages - 1}
          onClick={() => onPage(page + 1)}
        >
          Next
        </button>
      </span>
    </fieldset>
  )
}

function classes<R>(column: Column<R>): string {
  return `${column.numeric ? 'numeric' : ''}${column.minor ? ' minor' : ''}`
}
