/** Source of a design, as stored in addresses. */

import type { Design } from '../../format/value'

/** A design of a job (its best by default), a published design, or given values. */
export type DesignSource =
  | { readonly job: string; readonly iteration?: number; readonly particle?: number }
  | { readonly controller: string | null; readonly published: string }
  | { readonly controller: string; readonly design: Design }

export const DEFAULT_SOURCE: DesignSource = { controller: 'fuzzy-pi', published: 'A' }

/** An invalid address; the message describes the expected form. */
export class AddressError extends Error {
  override readonly name = 'AddressError'
}

/** Parse the source from a query. Throws AddressError. */
export function sourceOf(query: URLSearchParams): DesignSource {
  const [job, controller] = [query.get('job'), query.get('controller')]
  const [design, published] = [query.get('design'), query.get('published')]
  if (job) return jobSource(job, query.get('iteration'), query.get('particle'))
  if (design) return { controller: controller ?? 'fuzzy-pi', design: parsed(design) }
  return published || controller ? { controller, published: published ?? '' } : DEFAULT_SOURCE
}

const NO_QUERY: Readonly<Record<string, string | null>> = {
  job: null,
  iteration: null,
  particle: null,
  controller: null,
  published: null,
  design: null,
}

/** Query of a source; null removes a parameter. */
export function queryOf(source: DesignSource): Record<string, string | null> {
  const text = (value: unknown) =>
    typeof value === 'object' ? value && JSON.stringify(value) : String(value)
  const set = Object.entries(source).map(([name, value]) => [name, text(value)])
  return { ...NO_QUERY, ...Object.fromEntries(set) }
}

/** One-word form: `published:A`, `published:p/2011`, `job:ID`, `job:ID/24/7`. */
export function wordOf(source: DesignSource): string {
  if ('job' in source) {
    const { job, iteration, particle } = source
    return iteration === undefined ? `job:${job}` : `job:${job}/${iteration}/${particle}`
  }
  if ('design' in source) return `values:${source.controller}/${JSON.stringify(source.design)}`
  return `published:${source.controller ? `${source.controller}/` : ''}${source.published}`
}

/** Inverse of `wordOf`; null for no word. Throws AddressError. */
export function sourceOfWord(word: string | null): DesignSource | null {
  if (!word) return null
  const [, kind, rest] = /^(job|published|values):(.+)$/.exec(word) ?? []
  if (kind === 'job') {
    const [job, iteration = null, particle = null] = rest.split('/')
    return jobSource(job, iteration, particle)
  }
  if (kind === 'published') {
    const cut = rest.lastIndexOf('/')
    return { controller: cut < 0 ? null : rest.slice(0, cut), published: rest.slice(cut + 1) }
  }
  if (kind === 'values') {
    const cut = rest.indexOf('/')
    return { controller: rest.slice(0, cut), design: parsed(rest.slice(cut + 1)) }
  }
  throw new AddressError(`${word} is not a design; write published:A or job:ID`)
}

function jobSource(job: string, iteration: string | null, particle: string | null): DesignSource {
  if (!iteration && !particle) return { job }
  const numbers = [iteration, particle].map((text) => Number(text || Number.NaN))
  if (numbers.some((n) => !Number.isInteger(n) || n < 0)) {
    throw new AddressError('a design is given by iteration and particle, both from 0')
  }
  return { job, iteration: numbers[0], particle: numbers[1] }
}

function parsed(text: string): Design {
  let value: unknown
  try {
    value = JSON.parse(text)
  } catch {
    throw new AddressError('design is not JSON; write an object such as {"P": 0.25}')
  }
  const isObject = typeof value === 'object' && value !== null && !Array.isArray(value)
  const isValue = (v: unknown) => typeof v === 'number' || typeof v === 'string'
  if (isObject && Object.values(value as object).every(isValue)) return value as Design
  throw new AddressError(
    'design must be an object of numbers and names of choices such as {"P": 0.25}',
  )
}
