/** Tables as comma-separated values (RFC 4180) in full precision. */

import type { Cell } from '../components/table/rows'

export interface DataTable {
  readonly name: string
  readonly header: readonly string[]
  readonly rows: Iterable<readonly Cell[]>
}

export function csvOf({ header, rows }: DataTable): string {
  const lines = [line(header)]
  for (const row of rows) lines.push(line(row))
  return `${lines.join('\r\n')}\r\n`
}

/** Missing values are empty fields. */
function line(cells: readonly Cell[]): string {
  return cells.map(field).join(',')
}

function field(cell: Cell): string {
  if (cell === null || cell === undefined) return ''
  if (typeof cell === 'number') return Number.isFinite(cell) ? String(cell) : ''
  return /[",\r\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell
}

/** Stem of a file name: `Small job`, `Pareto front` -> `small-job-pareto-front`. */
export function fileStem(...parts: readonly string[]): string {
  const words = parts.map((part) =>
    part
      .normalize('NFKD')
      .toLowerCase()
      .replace(/[^\p{L}\p{N}]+/gu, '-')
      .replace(/^-+|-+$/g, ''),
  )
  return (
    words
      .filter((word) => word !== '')
      .join('-')
      .slice(0, 100) || 'chart'
  )
}
