/** Breadcrumb navigation; also sets the document title. */

import { useEffect } from 'preact/hooks'

export type Crumb = readonly [label: string, href: string]

export const ALL_JOBS: Crumb = ['All jobs', '/jobs']

interface BreadcrumbsProps {
  crumbs: readonly Crumb[]
  here: string
  title?: readonly string[]
}

/** crumbs: outermost first; here: the current page; title: parts of the document title. */
export function Breadcrumbs({ crumbs, here, title = [here] }: BreadcrumbsProps) {
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

let name = ''

export function setTitle(...parts: readonly string[]): void {
  name = parts[0] ?? ''
  document.title = [...parts, 'gaitswarm'].join(' · ')
}

/** First part of the title, such as a job's name; saved files are named after it. */
export function pageName(): string {
  return name
}
