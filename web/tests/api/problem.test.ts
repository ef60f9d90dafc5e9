import { expect, test } from 'vitest'
import { problemOf } from '../../src/api/problem'
import { quoted, submitCommand } from '../../src/job/reproduce/commands'

test('a problem keeps what the API says, field by field', async () => {
  const errors = [{ field: 'iterations', message: 'must be at least 1' }]
  const body = JSON.stringify({ detail: 'iterations: must be at least 1', errors })
  const headers = { 'content-type': 'application/problem+json' }
  const problem = await problemOf(new Response(body, { status: 422, headers }))
  expect(problem).toMatchObject({
    status: 422,
    detail: 'iterations: must be at least 1',
    errors,
    temporary: false,
  })
})

test('an answer that is no problem is told by its status', async () => {
  const answer = new Response('<html>', { status: 502, statusText: 'Bad Gateway' })
  const problem = await problemOf(answer)
  expect(problem.message).toBe('the server answered 502: Bad Gateway')
  expect(problem.temporary).toBe(true)
})

test('commands carry the whole spec as one word', () => {
  expect(quoted(`it's`)).toBe(`'it'\\''s'`)
  const command = submitCommand({ name: 'x' }, 'http://127.0.0.1:8000')
  expect(command).toContain('"name": "x"')
  expect(command.split('\n').at(-1)).toBe(
    'gaitswarm submit --spec job.json --server http://127.0.0.1:8000',
  )
})
