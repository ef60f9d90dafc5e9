/** Sorting, filtering and paging of table rows. */

export type Cell = string | number | null

export interface SortOrder {
  readonly column: string
  readonly descending: boolean
}

/** Stable sort by a value; rows without one come last in both directions. */
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

/** Rows that contain each word of the text, ignoring case. */
export function matching<R>(
  rows: readonly R[],
  text: string,
  words: (row: R) => string,
): readonly R[] {
  const terms = text
    .toLowerCase()
    .split(/\s+/)
    .filter((word) => word !== '')
  if (terms.length === 0) return rows
  return rows.filter((row) => {
    const content = words(row).toLowerCase()
    return terms.every((word) => content.includes(word))
  })
}

/** A page of rows, counted from 0; clamped to the last page. */
export function paged<R>(
  rows: readonly R[],
  page: number,
  size: number,
): { readonly rows: readonly R[]; readonly page: number; readonly pages: number } {
  const pages = Math.max(1, Math.ceil(rows.length / size))
  const at = Math.min(Math.max(0, page), pages - 1)
  return { rows: rows.slice(at * size, (at + 1) * size), page: at, pages }
}
