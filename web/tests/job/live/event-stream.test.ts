import { beforeEach, describe, expect, test } from 'vitest'
import type { Iteration } from '../../../src/api/types'
import { EventStream, type Followed, type Source } from '../../../src/job/live/event-stream'

/** A stream whose events the test sends. */
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

/** A clock that the test moves. */
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
let told: Followed | null
let stream: EventStream

const source = () => sources.at(-1)!
const iteration = (index: number) => ({ index, best: 1 }) as Iteration
const indices = () => told?.iterations.map(({ index }) => index)

beforeEach(() => {
  clock = new FakeClock()
  sources = []
  told = null
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
      told = followed
    },
  )
})

const receive = (...numbers: number[]) => {
  for (const number of numbers) source().send('iteration', iteration(number))
  clock.pass(50)
}

describe('a whole stream', () => {
  test('begins at the start and appends iterations in order', () => {
    source().send('open')
    receive(0, 1, 2)
    expect(sources[0].after).toBeNull()
    expect(indices()).toEqual([0, 1, 2])
    expect(told).toMatchObject({ connection: 'open', staleSince: null })
  })

  test('tells events that come together once', () => {
    let times = 0
    const counting = new EventStream(
      { open: () => new FakeSource(null), now: () => 0, later: clock.later },
      () => {
        times += 1
      },
    )
    const own = (counting as unknown as { source: FakeSource }).source
    for (let index = 0; index < 100; index++) own.send('iteration', iteration(index))
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
    expect(told).toMatchObject({ connection: 'ended', state: 'failed', error: 'the disk is full' })
  })
})

test('iterations that are known already are not asked for again', () => {
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

describe('a repeat', () => {
  test('is dropped', () => {
    source().send('open')
    receive(0, 1, 1, 0, 2)
    expect(indices()).toEqual([0, 1, 2])
  })
})

describe('a gap', () => {
  test('is never shown: the stream is opened again after the last iteration', () => {
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
  test('is stale since it broke, and goes on after the last iteration', () => {
    source().send('open')
    receive(0, 1)
    const broke = clock.now
    source().send('error')
    clock.pass(60)
    expect(told).toMatchObject({ connection: 'stale', staleSince: broke })
    clock.pass(1000)
    expect(source().after).toBe(1)
    source().send('open')
    receive(2)
    expect(indices()).toEqual([0, 1, 2])
    expect(told).toMatchObject({ connection: 'open', staleSince: null })
  })

  test('stays stale since the first break while it cannot be opened', () => {
    source().send('open')
    receive(0)
    const broke = clock.now
    for (let times = 0; times < 5; times++) {
      source().send('error')
      clock.pass(10_000)
    }
    expect(sources).toHaveLength(6)
    expect(told?.staleSince).toBe(broke)
  })

  test('waits longer each time, and not at all when the network is back', () => {
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

  test('no longer listens to what it had opened before', () => {
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

test('a closed stream opens nothing any more', () => {
  source().send('error')
  stream.close()
  clock.pass(60_000)
  expect(sources).toHaveLength(1)
})
