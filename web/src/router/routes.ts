/** Routes of the page. */

/** A page with the parameters of its path. */
export type Route =
  | { readonly page: 'jobs' }
  | { readonly page: 'new-job' }
  | { readonly page: 'job'; readonly id: string; readonly tab: string }
  | { readonly page: 'compare' }
  | { readonly page: 'walk' }
  | { readonly page: 'controller' }
  | { readonly page: 'not-found' }

/** The route of a path such as `/jobs/k2q7/iterations`; trailing slashes are ignored. */
export function routeOf(path: string): Route {
  const parts = path.split('/').filter((part) => part !== '')
  const [first, second, ...rest] = parts.map(decoded)
  switch (first) {
    case undefined:
      return { page: 'jobs' }
    case 'jobs':
      if (second === undefined) return { page: 'jobs' }
      if (second === 'new' && rest.length === 0) return { page: 'new-job' }
      return { page: 'job', id: second, tab: rest.join('/') }
    case 'compare':
      return second === undefined ? { page: 'compare' } : { page: 'not-found' }
    case 'walk':
      return second === undefined ? { page: 'walk' } : { page: 'not-found' }
    case 'controller':
      return second === undefined ? { page: 'controller' } : { page: 'not-found' }
    default:
      return { page: 'not-found' }
  }
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
