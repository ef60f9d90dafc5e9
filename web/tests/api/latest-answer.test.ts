import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { LatestAnswer } from '../../src/api/latest-answer'

beforeEach(() => {
  vi.useFakeTimers()
})
afterEach(() => {
  vi.useRealTimers()
})

/** Requests that were sent, to be answered in any order. */
function setUp() {
  const sent: { question: string; signal: AbortSignal; answer: (text: string) => void }[] = []
  const received: string[] = []
  const latest = new LatestAnswer<string, string>(
    (question, signal) =>
      new Promise((answer) => {
        sent.push({ question, signal, answer })
      }),
    (answer) => received.push(answer),
    () => received.push('failed'),
    50,
  )
  return { latest, sent, received: received }
}

test('requests in quick succession are sent once', async () => {
  const { latest, sent } = setUp()
  for (const question of ['a', 'b', 'c']) latest.ask(question)
  await vi.advanceTimersByTimeAsync(50)
  expect(sent.map(({ question }) => question)).toEqual(['c'])
})

test('a response overtaken by a later request is dropped', async () => {
  const { latest, sent, received } = setUp()
  latest.ask('slow')
  await vi.advanceTimersByTimeAsync(50)
  latest.ask('quick')
  await vi.advanceTimersByTimeAsync(50)
  sent[1].answer('to quick')
  sent[0].answer('to slow')
  await vi.advanceTimersByTimeAsync(1)
  expect(received).toEqual(['to quick'])
  expect(sent[0].signal.aborted).toBe(true)
})

test('no response is reported after stop', async () => {
  const { latest, sent, received } = setUp()
  latest.ask('a')
  await vi.advanceTimersByTimeAsync(50)
  latest.stop()
  sent[0].answer('too late')
  await vi.advanceTimersByTimeAsync(1)
  expect(received).toEqual([])
})
