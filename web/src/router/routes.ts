/** Routes of the page. */

const PAGES = ['jobs', 'compare', 'walk', 'controller'] as const

/** A page; id and tab: of a job, otherwise empty. */
export interface Route {
  readonly page: (typeof PAGES)[number] | 'new-job' | 'job' | 'not-found'
  readonly id: string
  readonly tab: string
}

/** The route of a path such as `/jobs/k2q7/iterations`; trailing slashes are ignored. */
export function routeOf(path: string): Route {
  const parts = path.split('/').filter((part) => part !== '')
  const [first = 'jobs', second, ...rest] = parts.map(decoded)
  const at = (page: Route['page']) => ({ page, id: '', tab: '' })
  if (second === undefined) return at(PAGES.find((page) => page === first) ?? 'not-found')
  if (first !== 'jobs') return at('not-found')
  if (second === 'new' && rest.length === 0) return at('new-job')
  return { page: 'job', id: second, tab: rest.join('/') }
}

export function jobPath(id: string, tab = ''): string {
  const base = `/jobs/${encodeURIComponent(id)}`
  return tab === '' ? base : `${base}/${tab}`
}

export function comparePath(ids: readonly string[]): string {
  return `/compare?jobs=${ids.map(encodeURIComponent).join(',')}`
}

/** Append the defined, non-empty values as a query. */
export function withQuery(
  path: string,
  query: Readonly<Record<string, string | number | undefined>>,
): string {
  const set = Object.entries(query).filter(([, value]) => value !== undefined && value !== '')
  if (set.length === 0) return path
  return `${path}?${new URLSearchParams(set.map(([name, value]) => [name, String(value)]))}`
}

/** Decode a path segment; invalid ones are left as they are. */
function decoded(part: string): string {
  try {
    return decodeURIComponent(part)
  } catch {
    return part
  }
}
