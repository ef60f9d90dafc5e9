/** Context in which tables pass their rows to an export instead of rendering. */

import { createContext } from 'preact'
import type { Column } from './table'

export interface CollectedTable {
  readonly caption: string
  readonly columns: readonly Column<unknown>[]
  readonly rows: readonly unknown[]
}

export const TableSink = createContext<((table: CollectedTable) => void) | null>(null)
