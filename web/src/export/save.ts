/** Files of a chart: its numbers, and its picture. Loaded when the first is asked for. */

import type { ComponentChildren } from 'preact'
import { pageName } from '../title'
import { csvOf, type DataTable, fileStem } from './csv'
import { pictureOf, pngOf } from './picture'
import { tablesOf } from './tables'

export type Kind = 'csv' | 'svg' | 'png'

export interface Chart {
  readonly title: string
  readonly card: HTMLElement
  /** What readers of screens get. */
  readonly table: () => ComponentChildren
  /** The chart's numbers, where its table holds some of them only. */
  readonly data?: () => DataTable
}

/** Several tables are as many files. */
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

/** Hand a file to the browser, which saves it or asks where. */
export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content)
  const link = document.createElement('a')
  link.href = address
  link.download = name
  link.click()
  // The browser has begun to read it by then.
  setTimeout(() => URL.revokeObjectURL(address), 10_000)
}
