/** A table with sortable columns and paging. */

import { type ComponentChildren, createContext } from 'preact'
import { useContext, useState } from 'preact/hooks'
import { formatCount, formatNumber, percent } from '../../format/number'
import { capitalized } from '../../format/words'
import { Unit } from '../text'
import { type Cell, paged, type SortOrder, sorted } from './rows'

export interface Column<R> {
  readonly key: string
  /** The key, capitalized, by default. */
  readonly label?: string
  /** Shown in place of the label. */
  readonly heading?: ComponentChildren
  /** Shown in brackets in the header; `1` is omitted. */
  readonly unit?: string
  readonly help?: string
  readonly numeric?: boolean
  /** Least significant digits of numbers; integers are shown in full. */
  readonly digits?: number
  /** Digits of a numeric column of shares, shown in percent. */
  readonly percent?: number
  /** Sort key; columns without one cannot be sorted by the table. */
  readonly value?: (row: R) => Cell
  /** Exported value; the sort key by default, otherwise the text shown. */
  readonly data?: (row: R) => Cell
  /** Whether the owner of externally sorted rows can sort by this column. */
  readonly sortable?: boolean
  /** Cell content; the sort key by default. */
  readonly cell?: (row: R) => ComponentChildren
  readonly minor?: boolean
  readonly header?: boolean
}

export interface CollectedTable {
  readonly caption: string
  readonly columns: readonly Column<unknown>[]
  readonly rows: readonly unknown[]
}

/** Context in which tables pass their rows to an export instead of rendering. */
export const TableSink = createContext<((table: CollectedTable) => void) | null>(null)

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
  external,
  cards = false,
}: {
  caption: string
  columns: readonly Column<R>[]
  rows: readonly R[]
  rowKey?: (row: R) => string
  order?: SortOrder
  onOrder?: (order: SortOrder) => void
  pageSize?: number
  /** Current page, from 0, if the address holds it; internal state by default. */
  paging?: readonly [page: number, onPage: (page: number) => void]
  /** Scroll inside a box of limited height. */
  tall?: boolean
  /** `data-` attributes of a row. */
  rowData?: (row: R) => Record<`data-${string}`, string | number>
  /** Show rows as cards on narrow screens. */
  cards?: boolean
  /** For rows sorted by the caller: their order, and the handler that changes it. */
  external?: { readonly order: SortOrder; readonly onOrder: (column: string) => void }
}) {
  const [localOrder, setOrder] = useState<SortOrder | null>(initial ?? null)
  const order = external?.order ?? localOrder
  const ownPage = useState(0)
  const [requestedPage, setRequestedPage] = paging ?? ownPage
  const sink = useContext(TableSink)
  if (sink) {
    sink({ caption, columns, rows } as unknown as CollectedTable)
    return null
  }
  const by = external ? undefined : columns.find(({ key }) => key === order?.column)?.value
  const inOrder = order && by ? sorted(rows, by, order.descending) : rows
  const page = paged(inOrder, requestedPage, pageSize)
  const first = page.page * pageSize
  const reorder = (chosen: SortOrder) => {
    if (external) return external.onOrder(chosen.column)
    setOrder(chosen)
    onOrder?.(chosen)
    // A new order starts at the first page.
    setRequestedPage(0)
  }
  return (
    <div>
      {/* A scrollable box must be reachable by keyboard. */}
      <section
        class={cards ? 'table-scroll cards' : tall ? 'table-scroll tall' : 'table-scroll'}
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
                  sortable={external ? column.sortable === true : column.value !== undefined}
                  order={order}
                  onOrder={reorder}
                />
              ))}
            </tr>
          </thead>
          <tbody>
            {page.rows.map((row, index) => (
              <tr key={rowKey?.(row) ?? index} {...rowData?.(row)}>
                {columns.map((column) => {
                  const content = contentOf(column, row)
                  return column.header ? (
                    <th key={column.key} scope="row" class={classes(column)}>
                      {content}
                    </th>
                  ) : (
                    <td key={column.key} class={classes(column)} data-label={headingOf(column)}>
                      {content}
                    </td>
                  )
                })}
              </tr>
            ))}
          </tbody>
        </table>
      </section>
      {page.pages > 1 && (
        <Pager
          caption={caption}
          shown={`${formatCount(first + 1)}–${formatCount(first + page.rows.length)} of ${formatCount(rows.length)}`}
          page={`page ${page.page + 1} of ${page.pages}`}
          onPage={[
            page.page > 0 ? () => setRequestedPage(page.page - 1) : null,
            page.page + 1 < page.pages ? () => setRequestedPage(page.page + 1) : null,
          ]}
        />
      )}
    </div>
  )
}

export function headingOf({ key, label }: Pick<Column<unknown>, 'key' | 'label'>): string {
  return label ?? capitalized(key)
}

function contentOf<R>({ cell, value, digits, percent: share }: Column<R>, row: R) {
  if (cell) return cell(row)
  const content = value?.(row)
  if (digits !== undefined) return formatNumber(content as number | null, digits)
  return share === undefined ? content : percent(content as number | null, share)
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
  const label = column.heading ?? (
    <>
      {headingOf(column)}
      <Unit unit={column.unit} />
    </>
  )
  const mark = active ? (order.descending ? ' ↓' : ' ↑') : ''
  return (
    <th
      scope="col"
      class={classes(column)}
      title={column.help}
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

interface PagerProps {
  caption: string
  shown: string
  page: string
  onPage: readonly [previous: (() => void) | null, next: (() => void) | null]
}

/** Buttons to the pages before and after the one shown. onPage: null for a page that is missing. */
export function Pager({ caption, shown, page, onPage }: PagerProps) {
  return (
    // A group, not a landmark: a page may have several tables.
    <fieldset class="pager" aria-label={`Pages of ${caption}`}>
      <span>{shown}</span>
      <span class="row">
        <button type="button" class="compact" disabled={!onPage[0]} onClick={() => onPage[0]?.()}>
          Previous
        </button>
        {page !== '' && <span>{page}</span>}
        <button type="button" class="compact" disabled={!onPage[1]} onClick={() => onPage[1]?.()}>
          Next
        </button>
      </span>
    </fieldset>
  )
}

function classes<R>({ numeric, digits, percent, minor }: Column<R>): string {
  const isNumeric = numeric ?? (digits ?? percent) !== undefined
  return `${isNumeric ? 'numeric' : ''}${minor ? ' minor' : ''}`
}
