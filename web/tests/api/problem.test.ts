import { expect, test } from 'vitest'
import { problemOf } from '../../src/api/problem'

test('a problem keeps the detail and the field errors of the API', async () => {
  const errors = [{ field: 'iterations', message: 'must be at least 1' }]
  const body = JSON.stringify({ detail: 'iterations: must be at least 1', errors })
  const headers = { 'content-type': 'application/problem+json' }
  const problem = await problemOf(new Response(body, { status: 422, headers }))
  expect(problem).toMatchObject({
    status: 422,
    detail: 'iterations: must be at least 1',
    errors,
  })
})

test('a response without problem details is reported by its status', async () => {
  const answer = new Response('<html>', { status: 502, statusText: 'Bad Gateway' })
  const problem = await problemOf(answer)
  expect(problem.message).toBe('the server responded with 502: Bad Gateway')
})
