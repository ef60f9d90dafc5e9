import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import type { Iteration } from '../../../src/api/types'
import { EventStream, type Followed, type Source } from '../../../src/job/live/event-stream'

/** A stream whose events are sent by the test. */
class FakeSource {
  closed = false
  private listeners = new Map<string, (event: MessageEvent<string>) => void>()

  constructor(readonly after: number | null) {}

  addEventListener(type: string, listener: (event: MessageEvent<string>) => void): void {
    this.listeners.set(type, listener)
  }

  close(): void {
    this.closed = true
  }

  send(type: string, data: unknown = null): void {
    this.listeners.get(type)?.({ data: JSON.stringify(data) } as MessageEvent<string>)
  }
}

let sources: FakeSource[]
let latest: Followed | null
let stream: EventStream

const open = (after: number | null) => {
  sources.push(new FakeSource(after))
  return source() as unknown as Source
}
const source = () => sources.at(-1)!
const iteration = (index: number) => ({ index, best: 1 }) as Iteration
const indices = () => latest?.iterations.map(({ index }) => index)

beforeEach(() => {
  vi.useFakeTimers({ now: 1000 })
  sources = []
  latest = null
  stream = new EventStream(open, (followed) => {
    latest = followed
  })
})
afterEach(() => {
  vi.useRealTimers()
})

const receive = (...numbers: number[]) => {
  for (const number of numbers) source().send('iteration', iteration(number))
  vi.advanceTimersByTime(50)
}

describe('an intact stream', () => {
  test('starts at the beginning and appends iterations in order', () => {
    source().send('open')
    receive(0, 1, 2)
    expect(sources[0].after).toBeNull()
    expect(indices()).toEqual([0, 1, 2])
    expect(latest).toMatchObject({ connection: 'open', staleSince: null })
  })

  test('reports simultaneous events once', () => {
    const changed = vi.fn()
    new EventStream(open, changed)
    for (let index = 0; index < 100; index++) source().send('iteration', iteration(index))
    vi.advanceTimersByTime(1000)
    expect(changed).toHaveBeenCalledOnce()
  })

  test('ends with a final state and does not reconnect', () => {
    source().send('open')
    receive(0)
    source().send('state', { state: 'failed', error: 'the disk is full' })
    source().send('error')
    vi.advanceTimersByTime(60_000)
    expect(sources).toHaveLength(1)
    expect(source().closed).toBe(true)
    expect(latest).toMatchObject({
      connection: 'ended',
      state: 'failed',
      error: 'the disk is full',
    })
  })
})

test('iterations already loaded are not requested again', () => {
  new EventStream(open, () => {}, [iteration(0), iteration(1)])
  expect(source().after).toBe(1)
})

describe('a duplicate', () => {
  test('is dropped', () => {
    source().send('open')
    receive(0, 1, 1, 0, 2)
    expect(indices()).toEqual([0, 1, 2])
  })
})

describe('a gap', () => {
  test('is never shown: the stream is reopened after the last iteration', () => {
    source().send('open')
    receive(0, 1, 4)
    expect(indices()).toEqual([0, 1])
    expect(sources).toHaveLength(2)
    expect(source().after).toBe(1)
    receive(2, 3, 4)
    expect(indices()).toEqual([0, 1, 2, 3, 4])
  })
})

describe('a broken stream', () => {
  test('is stale from the break on, and continues after the last iteration', () => {
    source().send('open')
    receive(0, 1)
    const broke = Date.now()
    source().send('error')
    vi.advanceTimersByTime(60)
    expect(latest).toMatchObject({ connection: 'stale', staleSince: broke })
    vi.advanceTimersByTime(1000)
    expect(source().after).toBe(1)
    source().send('open')
    receive(2)
    expect(indices()).toEqual([0, 1, 2])
    expect(latest).toMatchObject({ connection: 'open', staleSince: null })
  })

  test('stays stale since the first break until it is reopened', () => {
    source().send('open')
    receive(0)
    const broke = Date.now()
    for (let times = 0; times < 5; times++) {
      source().send('error')
      vi.advanceTimersByTime(10_000)
    }
    expect(sources).toHaveLength(6)
    expect(latest?.staleSince).toBe(broke)
  })

  test('backs off exponentially, but reconnects at once when the network is back', () => {
    source().send('open')
    source().send('error')
    vi.advanceTimersByTime(499)
    expect(sources).toHaveLength(1)
    vi.advanceTimersByTime(1)
    expect(sources).toHaveLength(2)
    source().send('error')
    vi.advanceTimersByTime(999)
    expect(sources).toHaveLength(2)
    stream.restart()
    expect(sources).toHaveLength(3)
  })

  test('ignores events of a previous connection', () => {
    const first = source()
    first.send('open')
    receive(0)
    first.send('error')
    vi.advanceTimersByTime(1000)
    first.send('iteration', iteration(1))
    vi.advanceTimersByTime(100)
    expect(indices()).toEqual([0])
  })
})

test('a closed stream does not reconnect', () => {
  source().send('error')
  stream.close()
  vi.advanceTimersByTime(60_000)
  expect(sources).toHaveLength(1)
})
