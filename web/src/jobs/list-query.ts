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
  name: 'by name',
  state: 'by state',
  evaluations: 'most evaluations first',
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
  }
}

/** Whether all jobs that are not archived, or all that are, fit. */
export function isFiltered(query: ListQuery): boolean {
  return query.search !== undefined || FACETS.some((facet) => query[facet] !== undefined)
}
