/** Filters and order of the job list as query parameters; the server applies them. */

import type { JobState } from '../api/types'

export const STATES: readonly JobState[] = [
  'queued',
  'running',
  'pausing',
  'paused',
  'succeeded',
  'failed',
  'cancelled',
]

export const ORDERS = {
  created: 'newest first',
  fitness: 'best searches first',
  gain: 'greatest gain first',
  name: 'by name',
  state: 'by state',
  priority: 'most urgent first',
  iterations: 'most iterations first',
  evaluations: 'most evaluations first',
  rate: 'fastest first',
  time_left: 'least time left first',
} as const

export type Order = keyof typeof ORDERS

export const PAGE = 50

export const MOST_COMPARED = 12

/** Filters in the order in which they are offered. */
export const FACETS = ['state', 'robot', 'controller', 'preference', 'tag'] as const

export type Facet = (typeof FACETS)[number]

export type ListQuery = ReturnType<typeof listQuery>

/** Orders that start with the greatest value; all others start with the smallest. */
const DESCENDING: readonly Order[] = ['gain', 'priority', 'iterations', 'evaluations', 'rate']

export function descends(order: Order, reverse: boolean): boolean {
  return DESCENDING.includes(order) !== reverse
}

/** Query changes to sort by an order; selecting the current one reverses it. */
export function reordered(
  { order, reverse }: ListQuery,
  column: Order,
): Readonly<Record<'order' | 'reverse' | 'after', string | null>> {
  return { order: column, reverse: order === column && !reverse ? '' : null, ...FIRST_PAGE }
}

/** Parse a query such as `?controller=pi&order=fitness`. */
export function listQuery(query: URLSearchParams) {
  const text = (name: string) => query.get(name) || undefined
  const order = query.get('order') ?? 'created'
  return {
    search: text('search'),
    state: STATES.find((state) => state === query.get('state')),
    robot: text('robot'),
    controller: text('controller'),
    preference: text('preference'),
    tag: text('tag'),
    archived: query.has('archived'),
    // The fitness of other kinds is another quantity.
    kind: order === 'fitness' || order === 'gain' ? ('tuning' as const) : undefined,
    order: order in ORDERS ? (order as Order) : 'created',
    reverse: query.has('reverse'),
  }
}

export const FIRST_PAGE = { after: null } as const

export function isFiltered(query: ListQuery): boolean {
  const { search, kind } = query
  return (
    search !== undefined || kind !== undefined || FACETS.some((facet) => query[facet] !== undefined)
  )
}
