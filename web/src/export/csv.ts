/** Tables as comma-separated values (RFC 4180) in full precision. */

import type { Cell } from '../components/table/rows'

export interface DataTable {
  readonly name: string
  readonly header: readonly string[]
  readonly rows: Iterable<readonly Cell[]>
}

/** Missing values are empty fields. */
export function csvOf({ header, rows }: DataTable): string {
  const lines = [header, ...rows].map((cells) => cells.map(field).join(','))
  return `${lines.join('\r\n')}\r\n`
}

function field(cell: Cell): string {
  if (cell === null || cell === undefined) return ''
  if (typeof cell === 'number') return Number.isFinite(cell) ? String(cell) : ''
  return /[",\r\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell
}

/** Stem of a file name: `Small job`, `Pareto front` -> `small-job-pareto-front`. */
export function fileStem(...parts: readonly string[]): string {
  const words = parts.join('-').normalize('NFKD').toLowerCase()
  const stem = words.replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-+|-+$/g, '')
  return stem.slice(0, 100) || 'chart'
}
