import { beforeEach, describe, expect, test } from 'vitest'
import type { Iteration } from '../../../src/api/types'
import { EventStream, type Followed, type Source } from '../../../src/job/live/event-stream'

/** A stream whose events are sent by the test. */
class FakeSource implements Source {
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

/** A clock advanced by the test. */
class FakeClock {
  now = 1000
  private due: { at: number; call: () => void }[] = []

  later = (call: () => void, milliseconds: number) => {
    const entry = { at: this.now + milliseconds, call }
    this.due.push(entry)
    return () => {
      this.due = this.due.filter((other) => other !== entry)
    }
  }

  pass(milliseconds: number): void {
    const until = this.now + milliseconds
    for (;;) {
      const next = this.due.filter(({ at }) => at <= until).sort((a, b) => a.at - b.at)[0]
      if (!next) break
      this.due = this.due.filter((other) => other !== next)
      this.now = next.at
      next.call()
    }
    this.now = until
  }
}

let clock: FakeClock
let sources: FakeSource[]
let latest: Followed | null
let stream: EventStream

const source = () => sources.at(-1)!
const iteration = (index: number) => ({ index, best: 1 }) as Iteration
const indices = () => latest?.iterations.map(({ index }) => index)

beforeEach(() => {
  clock = new FakeClock()
  sources = []
  latest = null
  stream = new EventStream(
    {
      open: (after) => {
        sources.push(new FakeSource(after))
        return source()
      },
      now: () => clock.now,
      later: clock.later,
    },
    (followed) => {
      latest = followed
    },
  )
})

const receive = (...numbers: number[]) => {
  for (const number of numbers) source().send('iteration', iteration(number))
  clock.pass(50)
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
    let times = 0
    const counting = new EventStream(
      { open: () => new FakeSource(null), now: () => 0, later: clock.later },
      () => {
        times += 1
      },
    )
    const countingSource = (counting as unknown as { source: FakeSource }).source
    for (let index = 0; index < 100; index++) countingSource.send('iteration', iteration(index))
    clock.pass(1000)
    expect(times).toBe(1)
  })

  test('ends with a final state and does not reconnect', () => {
    source().send('open')
    receive(0)
    source().send('state', { state: 'failed', error: 'the disk is full' })
    source().send('error')
    clock.pass(60_000)
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
  let after: number | null = null
  const seeded = new EventStream({
    open: (last) => {
      after = last
      return new FakeSource(last)
    },
    now: () => 0,
    later: clock.later,
  }, () => {}, [iteration(0), iteration(1)])
  expect(after).toBe(1)
  expect(seeded.last).toBe(1)
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
    const broke = clock.now
    source().send('error')
    clock.pass(60)
    expect(latest).toMatchObject({ connection: 'stale', staleSince: broke })
    clock.pass(1000)
    expect(source().after).toBe(1)
    source().send('open')
    receive(2)
    expect(indices()).toEqual([0, 1, 2])
    expect(latest).toMatchObject({ connection: 'open', staleSince: null })
  })

  test('stays stale since the first break until it is reopened', () => {
    source().send('open')
    receive(0)
    const broke = clock.now
    for (let times = 0; times < 5; times++) {
      source().send('error')
      clock.pass(10_000)
    }
    expect(sources).toHaveLength(6)
    expect(latest?.staleSince).toBe(broke)
  })

  test('backs off exponentially, but reconnects at once when the network is back', () => {
    source().send('open')
    source().send('error')
    clock.pass(499)
    expect(sources).toHaveLength(1)
    clock.pass(1)
    expect(sources).toHaveLength(2)
    source().send('error')
    clock.pass(999)
    expect(sources).toHaveLength(2)
    stream.restart()
    expect(sources).toHaveLength(3)
  })

  test('ignores events of a previous connection', () => {
    const first = source()
    first.send('open')
    receive(0)
    first.send('error')
    clock.pass(1000)
    first.send('iteration', iteration(1))
    clock.pass(100)
    expect(indices()).toEqual([0])
  })
})

test('a closed stream does not reconnect', () => {
  source().send('error')
  stream.close()
  clock.pass(60_000)
  expect(sources).toHaveLength(1)
})
