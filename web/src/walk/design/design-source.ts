/** Source of a design, as stored in addresses. */

import type { Design } from '../../format/value'

/** A design of a job (its best by default), a published design, or given values. */
export type DesignSource =
  | { readonly kind: 'best'; readonly job: string }
  | {
      readonly kind: 'particle'
      readonly job: string
      readonly iteration: number
      readonly particle: number
    }
  | { readonly kind: 'published'; readonly controller: string | null; readonly study: string }
  | {
      readonly kind: 'values'
      readonly controller: string
      readonly design: Design
    }

/** Default: the thesis's optimum A. */
export const DEFAULT_SOURCE: DesignSource = {
  kind: 'published',
  controller: 'fuzzy-pi',
  study: 'A',
}

/** An invalid address; the message describes the expected form. */
export class AddressError extends Error {
  override readonly name = 'AddressError'
}

/** Parse the source from a query. Throws AddressError. */
export function sourceOf(query: URLSearchParams): DesignSource {
  const job = query.get('job')
  const controller = query.get('controller')
  if (job) return jobSource(job, query.get('iteration'), query.get('particle'))
  const design = query.get('design')
  if (design)
    return { kind: 'values', controller: controller ?? 'fuzzy-pi', design: parsed(design) }
  const study = query.get('published')
  if (study) return { kind: 'published', controller, study }
  return controller ? { kind: 'published', controller, study: '' } : DEFAULT_SOURCE
}

/** Query of a source; null removes a parameter. */
export function queryOf(source: DesignSource): Record<string, string | null> {
  const none = {
    job: null,
    iteration: null,
    particle: null,
    controller: null,
    published: null,
    design: null,
  }
  switch (source.kind) {
    case 'best':
      return { ...none, job: source.job }
    case 'particle':
      return {
        ...none,
        job: source.job,
        iteration: String(source.iteration),
        particle: String(source.particle),
      }
    case 'published':
      return { ...none, controller: source.controller, published: source.study }
    case 'values':
      return { ...none, controller: source.controller, design: JSON.stringify(source.design) }
  }
}

/** One-word form: `published:A`, `published:p/2011`, `job:ID`, `job:ID/24/7`. */
export function wordOf(source: DesignSource): string {
  switch (source.kind) {
    case 'best':
      return `job:${source.job}`
    case 'particle':
      return `job:${source.job}/${source.iteration}/${source.particle}`
    case 'published':
      return `published:${source.controller ? `${source.controller}/` : ''}${source.study}`
    case 'values':
      return `values:${source.controller}/${JSON.stringify(source.design)}`
  }
}

/** Inverse of `wordOf`; null for no word. Throws AddressError. */
export function sourceOfWord(word: string | null): DesignSource | null {
  if (!word) return null
  const at = word.indexOf(':')
  const [kind, rest] = [word.slice(0, at), word.slice(at + 1)]
  if (kind === 'job' && rest !== '') {
    const [job, iteration = null, particle = null] = rest.split('/')
    return jobSource(job, iteration, particle)
  }
  if (kind === 'published' && rest !== '') {
    const cut = rest.lastIndexOf('/')
    const controller = cut < 0 ? null : rest.slice(0, cut)
    return { kind: 'published', controller, study: rest.slice(cut + 1) }
  }
  if (kind === 'values') {
    const cut = rest.indexOf('/')
    return { kind: 'values', controller: rest.slice(0, cut), design: parsed(rest.slice(cut + 1)) }
  }
  throw new AddressError(`${word} is not a design; write published:A or job:ID`)
}

function jobSource(job: string, iteration: string | null, particle: string | null): DesignSource {
  if (!iteration && !particle) return { kind: 'best', job }
  const numbers = [iteration, particle].map((text) => Number(text || Number.NaN))
  if (numbers.some((n) => !Number.isInteger(n) || n < 0)) {
    throw new AddressError('a design is given by iteration and particle, both from 0')
  }
  return { kind: 'particle', job, iteration: numbers[0], particle: numbers[1] }
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
  if (!isObject || !Object.values(value as object).every(isValue)) {
    throw new AddressError(
      'design must be an object of numbers and names of choices such as {"P": 0.25}',
    )
  }
  return value as Design
}
