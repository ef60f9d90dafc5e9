/** The tables of a chart as data: all rows, in full precision. */

import { type ComponentChildren, render } from 'preact'
import type { Cell } from '../components/table/rows'
import type { Column } from '../components/table/table'
import { type CollectedTable, TableSink } from '../components/table/table-sink'
import { withUnit } from '../format/number'
import type { DataTable } from './csv'

export function tablesOf(content: ComponentChildren): readonly DataTable[] {
  const collected: CollectedTable[] = []
  const place = document.createElement('div')
  render(
    <TableSink.Provider value={(table) => collected.push(table)}>{content}</TableSink.Provider>,
    place,
  )
  render(null, place)
  return collected.map(dataOf)
}

function dataOf({ caption, columns, rows }: CollectedTable): DataTable {
  return {
    name: caption,
    header: columns.map(({ label, unit = '1' }) => withUnit(label, unit)),
    rows: rows.map((row) => columns.map((column) => cellOf(column, row))),
  }
}

function cellOf(column: Column<unknown>, row: unknown): Cell {
  if (column.data) return column.data(row)
  if (column.value) return column.value(row)
  const place = document.createElement('div')
  render(column.cell?.(row) ?? null, place)
  const text = place.textContent
  render(null, place)
  return text
}
