/** What the list of jobs shows, as its address says; the server finds and sorts. Pure. */

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
  fitness: 'best first',
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

/** Jobs of one page. */
export const PAGE = 50

/** Filters by facet, in the order in which they are offered. */
export const FACETS = ['state', 'robot', 'controller', 'preference', 'tag'] as const

export type Facet = (typeof FACETS)[number]

export interface ListQuery {
  readonly search?: string
  readonly state?: JobState
  readonly robot?: string
  readonly controller?: string
  readonly preference?: string
  readonly tag?: string
  readonly archived: boolean
  readonly order: Order
  /** Whether the order is turned round. */
  readonly reverse: boolean
}

/** Orders that begin with what is greatest; all others begin with what is least. */
const DESCENDING: readonly Order[] = ['gain', 'priority', 'iterations', 'evaluations', 'rate']

/** Whether a list goes from what is great to what is little. */
export function descends(order: Order, reverse: boolean): boolean {
  return DESCENDING.includes(order) !== reverse
}

/** What the address is to say when a column is sorted by: turned round if it is already. */
export function reordered(
  { order, reverse }: ListQuery,
  wanted: Order,
): Readonly<Record<'order' | 'reverse' | 'after', string | null>> {
  return { order: wanted, reverse: order === wanted && !reverse ? '' : null, ...FIRST_PAGE }
}

/** What an address such as `?controller=pi&order=fitness` asks for. */
export function listQuery(query: URLSearchParams): ListQuery {
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
    order: order in ORDERS ? (order as Order) : 'created',
    reverse: query.has('reverse'),
  }
}

/** Another filter or order has other pages. */
export const FIRST_PAGE = { after: null } as const

/** Whether all jobs that are not archived, or all that are, fit. */
export function isFiltered(query: ListQuery): boolean {
  return query.search !== undefined || FACETS.some((facet) => query[facet] !== undefined)
}
