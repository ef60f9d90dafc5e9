import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { LatestAnswer } from '../../src/api/latest-answer'

beforeEach(() => {
  vi.useFakeTimers()
})
afterEach(() => {
  vi.useRealTimers()
})

/** Questions that were sent, to be answered in any order. */
function setUp() {
  const sent: { question: string; signal: AbortSignal; answer: (text: string) => void }[] = []
  const told: string[] = []
  const latest = new LatestAnswer<string, string>(
    (question, signal) =>
      new Promise((answer) => {
        sent.push({ question, signal, answer })
      }),
    (answer) => told.push(answer),
    () => told.push('failed'),
    50,
  )
  return { latest, sent, told }
}

test('questions in quick succession are asked once', async () => {
  const { latest, sent } = setUp()
  for (const question of ['a', 'b', 'c']) latest.ask(question)
  await vi.advanceTimersByTimeAsync(50)
  expect(sent.map(({ question }) => question)).toEqual(['c'])
})

test('an answer that a later question has overtaken is dropped', async () => {
  const { latest, sent, told } = setUp()
  latest.ask('slow')
  await vi.advanceTimersByTimeAsync(50)
  latest.ask('quick')
  await vi.advanceTimersByTimeAsync(50)
  sent[1].answer('to quick')
  sent[0].answer('to slow')
  await vi.advanceTimersByTimeAsync(1)
  expect(told).toEqual(['to quick'])
  expect(sent[0].signal.aborted).toBe(true)
})

test('after stop nothing is told', async () => {
  const { latest, sent, told } = setUp()
  latest.ask('a')
  await vi.advanceTimersByTimeAsync(50)
  latest.stop()
  sent[0].answer('too late')
  await vi.advanceTimersByTimeAsync(1)
  expect(told).toEqual([])
})
