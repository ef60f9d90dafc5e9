import { expect, test } from 'vitest'
import { url } from '../../src/api/client'
import { jobPath, routeOf, withQuery } from '../../src/router/routes'

test.each([
  ['/', { page: 'jobs' }],
  ['/jobs', { page: 'jobs' }],
  ['/jobs/', { page: 'jobs' }],
  ['/jobs/new', { page: 'new-job' }],
  ['/jobs/k2q7', { page: 'job', id: 'k2q7', tab: '' }],
  ['/jobs/k2q7/iterations/12', { page: 'job', id: 'k2q7', tab: 'iterations/12' }],
  ['/walk', { page: 'walk' }],
  ['/controller', { page: 'controller' }],
  ['/walk/further', { page: 'not-found' }],
  ['/nowhere', { page: 'not-found' }],
  ['/jobs/%E0%A4%A', { page: 'job', id: '%E0%A4%A', tab: '' }],
])('%s is its page', (path, route) => {
  expect(routeOf(path)).toMatchObject(route)
})

test('a path of a job leads back to the job', () => {
  expect(routeOf(jobPath('a b/c', 'iterations'))).toEqual({
    page: 'job',
    id: 'a b/c',
    tab: 'iterations',
  })
})

test('unset values are omitted from a query', () => {
  const query = { job: 'k2', iteration: 0, particle: undefined, scenario: '' }
  expect(withQuery('/walk', query)).toBe('/walk?job=k2&iteration=0')
})

test('an API path has its parameters filled in and null omitted', () => {
  expect(url('/v1/jobs/{job_id}/events', { job_id: 'a/b' }, { after: null, limit: 3 })).toBe(
    '/v1/jobs/a%2Fb/events?limit=3',
  )
})
