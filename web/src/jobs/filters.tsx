/** Filters and order of the job list, stored in the address. */

import type { ComponentChildren } from 'preact'
import type { JobFacets } from '../api/types'
import { formatCount } from '../format/number'
import { capitalized } from '../format/words'
import { setQuery } from '../router/navigation'
import { FACETS, type Facet, FIRST_PAGE, type ListQuery, ORDERS, STATES } from './list-query'

/** Query changes that reset all filters. */
export const NO_FILTER: Readonly<Record<string, null>> = {
  ...FIRST_PAGE,
  search: null,
  archived: null,
  ...Object.fromEntries(FACETS.map((facet) => [facet, null])),
}

const COUNTS = {
  state: 'states',
  robot: 'robots',
  controller: 'controllers',
  preference: 'preferences',
  tag: 'tags',
} as const

export function Filters({
  query,
  facets,
  children,
}: {
  query: ListQuery
  /** Null while loading. */
  facets: JobFacets | null
  /** Number of matches. */
  children: ComponentChildren
}) {
  return (
    <search class="row filters">
      <label>
        <span class="visually-hidden">Search by name, id, note or tag</span>
        <input
          type="search"
          placeholder="Search by name, id, note or tag"
          value={query.search ?? ''}
          onInput={(event) =>
            setQuery({ ...FIRST_PAGE, search: event.currentTarget.value || null })
          }
        />
      </label>
      {FACETS.map((facet) => (
        <FacetFilter key={facet} facet={facet} query={query} facets={facets} />
      ))}
      <select
        aria-label="Order"
        value={query.order}
        onChange={(event) =>
          setQuery({ ...FIRST_PAGE, order: event.currentTarget.value, reverse: null })
        }
      >
        {Object.entries(ORDERS).map(([order, words]) => (
          <option key={order} value={order}>
            {words}
          </option>
        ))}
      </select>
      <label class="check small">
        <input
          type="checkbox"
          checked={query.archived}
          onChange={() => setQuery({ ...FIRST_PAGE, archived: query.archived ? null : '' })}
        />
        archived
      </label>
      <span class="muted small" aria-live="polite">
        {children}
      </span>
    </search>
  )
}

function FacetFilter({
  facet,
  query,
  facets,
}: {
  facet: Facet
  query: ListQuery
  facets: JobFacets | null
}) {
  const chosen = query[facet]
  const counts: Readonly<Record<string, number>> = facets?.[COUNTS[facet]] ?? {}
  const names = facet === 'state' ? STATES.filter((s) => s in counts) : Object.keys(counts).sort()
  const offered =
    chosen === undefined || names.includes(chosen as never) ? names : [...names, chosen]
  // A single option cannot filter.
  if (chosen === undefined && offered.length < 2 && facet !== 'state') return null
  return (
    <select
      aria-label={capitalized(facet)}
      value={chosen ?? ''}
      onChange={(event) => setQuery({ ...FIRST_PAGE, [facet]: event.currentTarget.value || null })}
    >
      <option value="">
        all {COUNTS[facet]}
        {facet === 'state' && facets ? ` (${formatCount(facets.total)})` : ''}
      </option>
      {offered.map((name) => (
        <option key={name} value={name}>
          {name} ({formatCount(counts[name] ?? 0)})
        </option>
      ))}
    </select>
  )
}
