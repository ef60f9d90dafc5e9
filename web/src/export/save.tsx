/** Saves a chart's numbers or picture as files. Loaded on demand. */

import { type ComponentChildren, render } from 'preact'
import type { Cell } from '../components/table/rows'
import { type CollectedTable, type Column, headingOf, TableSink } from '../components/table/table'
import { withUnit } from '../format/number'
import { pageName } from '../router/breadcrumbs'
import { csvOf, type DataTable, fileStem } from './csv'
import { pictureOf, pngOf } from './picture'

export type Kind = 'csv' | 'svg' | 'png'

export interface Chart {
  readonly title: string
  readonly card: HTMLElement
  readonly table: () => ComponentChildren
  readonly data?: () => DataTable
}

export async function saveChart(kind: Kind, chart: Chart): Promise<void> {
  const stem = fileStem(pageName(), chart.title)
  if (kind === 'csv') {
    const tables = chart.data ? [chart.data()] : tablesOf(chart.table())
    if (tables.length === 0) throw new Error('This chart has no numbers.')
    for (const [k, table] of tables.entries()) {
      const name = k === 0 ? stem : fileStem(pageName(), table.name)
      saveFile(new Blob([csvOf(table)], { type: 'text/csv' }), `${name}.csv`)
    }
    return
  }
  const picture = pictureOf(chart.card)
  const blob =
    kind === 'png' ? await pngOf(picture) : new Blob([picture.svg], { type: 'image/svg+xml' })
  saveFile(blob, `${stem}.${kind}`)
}

export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content)
  const link = document.createElement('a')
  link.href = address
  link.download = name
  link.click()
  // Allow time for the download to start.
  setTimeout(() => URL.revokeObjectURL(address), 10_000)
}

/** The tables of a chart as data: all rows, in full precision. */
function tablesOf(content: ComponentChildren): readonly DataTable[] {
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
    header: columns.map((column) => withUnit(headingOf(column), column.unit ?? '1')),
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
