/** Where tables put their rows when a file is made of them, rather than being shown. */

import { createContext } from 'preact'
import type { Column } from './table'

export interface CollectedTable {
  readonly caption: string
  readonly columns: readonly Column<unknown>[]
  readonly rows: readonly unknown[]
}

export const TableSink = createContext<((table: CollectedTable) => void) | null>(null)
