import { describe, expect, test } from 'vitest'
import {
  AddressError,
  DEFAULT_SOURCE,
  type DesignSource,
  queryOf,
  sourceOf,
  sourceOfWord,
  wordOf,
} from '../../../src/walk/design/design-source'

const SOURCES: DesignSource[] = [
  { job: 'k2q7' },
  { job: 'k2q7', iteration: 24, particle: 0 },
  { controller: 'fuzzy-pi', published: 'A' },
  { controller: 'p', design: { P: 0.25, fir_window: 'hamming' } },
]

describe.each(SOURCES)('%o', (source) => {
  test('is restored from its query', () => {
    const entries = Object.entries(queryOf(source)).filter(([, value]) => value !== null)
    expect(sourceOf(new URLSearchParams(entries as [string, string][]))).toEqual(source)
  })

  test('is restored from its word', () => {
    expect(sourceOfWord(wordOf(source))).toEqual(source)
  })
})

test('an empty address shows the published optimum', () => {
  expect(sourceOf(new URLSearchParams('scenario=slope-fast'))).toEqual(DEFAULT_SOURCE)
})

test('a published design can be named without its controller', () => {
  const source = { controller: null, published: 'A' }
  expect(sourceOfWord('published:A')).toEqual(source)
})

test('an empty word names no design', () => {
  expect([sourceOfWord(null), sourceOfWord('')]).toEqual([null, null])
})

test.each([
  ['job=k2q7&iteration=3', /both from 0/],
  ['job=k2q7&iteration=x&particle=1', /both from 0/],
  ['design={"P":true}', /object of numbers/],
  ['design=[1]', /object of numbers/],
  ['design={', /not JSON/],
])('%s is refused', (query, message) => {
  expect(() => sourceOf(new URLSearchParams(query))).toThrow(AddressError)
  expect(() => sourceOf(new URLSearchParams(query))).toThrow(message)
})

test('a word of another kind is refused', () => {
  expect(() => sourceOfWord('A')).toThrow(/published:A or job:ID/)
})
