import { expect, test } from 'vitest'
import { url } from '../../src/api/client'

test('path parameters are filled in and encoded', () => {
  expect(url('/v1/jobs/{job_id}', { job_id: 'a/b' })).toBe('/v1/jobs/a%2Fb')
})

test('unset values are omitted from the query', () => {
  expect(url('/v1/jobs', {}, { after: undefined, state: null })).toBe('/v1/jobs')
  expect(url('/v1/jobs', {}, { limit: 0, search: 'a b' })).toBe('/v1/jobs?limit=0&search=a+b')
})

test('list values repeat the parameter name', () => {
  expect(url('/v1/jobs', {}, { also: ['a', 'b'] })).toBe('/v1/jobs?also=a&also=b')
  expect(url('/v1/jobs', {}, { also: [] })).toBe('/v1/jobs')
})
