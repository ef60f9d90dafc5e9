/** Rows of a table: which are shown, and in which order. Pure. */

export type Cell = string | number | null

export interface SortOrder {
  readonly column: string
  readonly descending: boolean
}

/** Rows in order of a value; what has none comes last in both directions, ties keep their order. */
export function sorted<R>(
  rows: readonly R[],
  value: (row: R) => Cell,
  descending: boolean,
): readonly R[] {
  const direction = descending ? -1 : 1
  return [...rows].sort((a, b) => {
    const [x, y] = [value(a), value(b)]
    if (x === null || y === null) return x === y ? 0 : x === null ? 1 : -1
    if (typeof x === 'number' && typeof y === 'number') return direction * (x - y)
    return direction * String(x).localeCompare(String(y), 'en', { numeric: true })
  })
}

/** Rows in which each word of the text occurs, in upper or lower case. */
export function matching<R>(
  rows: readonly R[],
  text: string,
  words: (row: R) => string,
): readonly R[] {
  const wanted = text
    .toLowerCase()
    .split(/\s+/)
    .filter((word) => word !== '')
  if (wanted.length === 0) return rows
  return rows.filter((row) => {
    const found = words(row).toLowerCase()
    return wanted.every((word) => found.includes(word))
  })
}

/** A page of rows, from 0; a page past the end is the last one. */
export function paged<R>(
  rows: readonly R[],
  page: number,
  size: number,
): { readonly rows: readonly R[]; readonly page: number; readonly pages: number } {
  const pages = Math.max(1, Math.ceil(rows.length / size))
  const at = Math.min(Math.max(0, page), pages - 1)
  return { rows: rows.slice(at * size, (at + 1) * size), page: at, pages }
}
