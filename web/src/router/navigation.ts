/** Client-side navigation and the address as state. */

import { Changes, useFollowed } from '../changes'

export interface Place {
  readonly path: string
  readonly query: URLSearchParams
}

const changes = new Changes()

/** Go to an address of this page, for example `/jobs/new?clone=k2q7`. */
export function navigate(href: string, { replace = false } = {}): void {
  if (replace) history.replaceState(null, '', href)
  else history.pushState(null, '', href)
  changes.notify()
}

/** Changes of a query: a value, several values of one name, or null to remove it. */
export type QueryChanges = Readonly<Record<string, string | readonly string[] | null>>

/** Change query parameters; by default without a new history entry. */
export function setQuery(changes: QueryChanges, { replace = true } = {}): void {
  const query = new URLSearchParams(location.search)
  for (const [name, value] of Object.entries(changes)) {
    const [first, ...rest] = [value ?? []].flat()
    if (first === undefined) query.delete(name)
    else query.set(name, first)
    for (const each of rest) query.append(name, each)
  }
  const text = query.toString()
  navigate(text === '' ? location.pathname : `${location.pathname}?${text}`, { replace })
}

export function usePlace(): Place {
  const href = useFollowed(changes, () => location.pathname + location.search)
  const { pathname, searchParams } = new URL(href, location.origin)
  return { path: pathname, query: searchParams }
}

/** Handle Back, and plain clicks on links to paths of this page, without reloading. */
export function followLinks(): void {
  addEventListener('popstate', () => changes.notify())
  document.addEventListener('click', (event) => {
    if (event.defaultPrevented || event.button !== 0) return
    if (event.metaKey || event.ctrlKey || event.shiftKey || event.altKey) return
    const link = (event.target as Element | null)?.closest('a')
    if (!link || link.target !== '' || link.hasAttribute('download')) return
    if (link.origin !== location.origin || !isOwnPath(link.pathname)) return
    // Fragments of the current page, such as the skip link's, are left to the browser.
    if (link.hash !== '' && isHere(link)) return
    event.preventDefault()
    navigate(link.pathname + link.search + link.hash)
    scrollTo(0, 0)
  })
}

function isHere({ pathname, search }: HTMLAnchorElement): boolean {
  return pathname === location.pathname && search === location.search
}

/** Whether a path is handled here; others, such as /docs and /v1, are left to the browser. */
function isOwnPath(path: string): boolean {
  return path === '/' || /^\/(jobs|compare|walk|controller)(\/|$)/.test(path)
}
