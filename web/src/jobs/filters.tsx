/** Filters and order of the job list, stored in the address. */

import type { ComponentChildren } from 'preact'
import type { JobFacets } from '../api/types'
import { Check, Select } from '../components/fields/controls'
import { formatCount } from '../format/number'
import { capitalized } from '../format/words'
import { setQuery } from '../router/navigation'
import {
  FACETS,
  type Facet,
  FIRST_PAGE,
  type ListQuery,
  ORDERS,
  type Order,
  STATES,
} from './list-query'

export const NO_FILTER: Readonly<Record<string, null>> = {
  ...FIRST_PAGE,
  search: null,
  archived: null,
  ...Object.fromEntries(FACETS.map((facet) => [facet, null])),
}

interface FiltersProps {
  query: ListQuery
  facets: JobFacets | null
  children: ComponentChildren
}

export function Filters({ query, facets, children }: FiltersProps) {
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
      <Select
        hidden
        label="Order"
        value={query.order}
        options={Object.entries(ORDERS) as [Order, string][]}
        onChoose={(order) => setQuery({ ...FIRST_PAGE, order, reverse: null })}
      />
      <Check
        label="archived"
        checked={query.archived}
        onChange={(on) => setQuery({ ...FIRST_PAGE, archived: on ? '' : null })}
      />
      <span class="muted small" aria-live="polite">
        {children}
      </span>
    </search>
  )
}

interface FacetFilterProps {
  facet: Facet
  query: ListQuery
  facets: JobFacets | null
}

function FacetFilter({ facet, query, facets }: FacetFilterProps) {
  const selected = query[facet]
  const counts: Readonly<Record<string, number>> = facets?.[`${facet}s`] ?? {}
  const names: string[] =
    facet === 'state' ? STATES.filter((s) => s in counts) : Object.keys(counts).sort()
  if (selected !== undefined && !names.includes(selected)) names.push(selected)
  // A single option cannot filter.
  if (selected === undefined && names.length < 2 && facet !== 'state') return null
  const total = facet === 'state' && facets ? ` (${formatCount(facets.total)})` : ''
  return (
    <Select
      hidden
      label={capitalized(facet)}
      value={selected ?? ''}
      options={[
        ['', `all ${facet}s${total}`],
        ...names.map((name) => [name, `${name} (${formatCount(counts[name] ?? 0)})`] as const),
      ]}
      onChoose={(name) => setQuery({ ...FIRST_PAGE, [facet]: name || null })}
    />
  )
}
