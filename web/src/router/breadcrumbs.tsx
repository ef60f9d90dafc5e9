/** Where a page lies below others, each a link; the tab is called by it. */

import { useEffect } from 'preact/hooks'
import { setTitle } from '../title'

export type Crumb = readonly [label: string, href: string]

export const ALL_JOBS: Crumb = ['All jobs', '/jobs']

/** crumbs: from the outermost; here: the page itself; title: of the tab, what is shown first. */
export function Breadcrumbs({
  crumbs,
  here,
  title = [here],
}: {
  crumbs: readonly Crumb[]
  here: string
  title?: readonly string[]
}) {
  useEffect(() => setTitle(...title), [title.join()])
  return (
    <nav class="breadcrumbs small" aria-label="Breadcrumbs">
      <ol>
        {crumbs.map(([label, href]) => (
          <li key={href}>
            <a href={href}>{label}</a>
          </li>
        ))}
        <li aria-current="page">{here}</li>
      </ol>
    </nav>
  )
}
