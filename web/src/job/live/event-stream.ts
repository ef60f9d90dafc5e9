/** A job's events: every committed iteration once and in order, whatever happens to the network. */

import type { Iteration, JobState } from '../../api/types'
import { hasEnded } from '../state'

export type Connection = 'connecting' | 'open' | 'stale' | 'ended'

/** What is known of a job from its events. */
export interface Followed {
  /** Without gap or repeat, from index 0. */
  readonly iterations: readonly Iteration[]
  readonly state: JobState | null
  readonly error: string | null
  /** What it waits for, such as workers that are away. */
  readonly waiting: string | null
  readonly connection: Connection
  /** When the stream broke [ms]; null while it is whole. */
  readonly staleSince: number | null
}

/** The part of EventSource that is used. */
export interface Source {
  addEventListener(type: string, listener: (event: MessageEvent<string>) => void): void
  close(): void
}

export interface StreamPorts {
  /** Open the stream after an iteration, from the start if null. */
  open(after: number | null): Source
  now(): number
  /** Call back after some time [ms]; returns what cancels it. */
  later(call: () => void, milliseconds: number): () => void
}

const FIRST_WAIT_MS = 500
const LONGEST_WAIT_MS = 8000
/** Events that come together are told together. */
const GATHER_MS = 40

/**
 * Follows one job.
 *
 * | event | what happens |
 * | --- | --- |
 * | the iteration after the last | it is appended |
 * | an iteration that is there already | it is dropped |
 * | an iteration further on | reconnect after the last, so that the gap is filled |
 * | the stream breaks | stale; reconnect after the last, waiting longer each time |
 * | the job was deleted | ended; asking for the job then says that it is gone |
 * | a final state | ended; `restart` follows a job that was resumed or extended |
 */
export class EventStream {
  private readonly iterations: Iteration[]
  private state: JobState | null = null
  private error: string | null = null
  private waiting: string | null = null
  private connection: Connection = 'connecting'
  private staleSince: number | null = null
  private source: Source | null = null
  private failures = 0
  private cancelRetry: (() => void) | null = null
  private cancelTell: (() => void) | null = null

  constructor(
    private readonly ports: StreamPorts,
    private readonly changed: (followed: Followed) => void,
    /** Iterations that are known already, from index 0; the stream goes on after them. */
    known: readonly Iteration[] = [],
  ) {
    this.iterations = [...known]
    this.connect()
  }

  /** Index of the last iteration; null before the first. */
  get last(): number | null {
    return this.iterations.at(-1)?.index ?? null
  }

  /** Follow on, at once: after an end that was none, or when the network is said to be back. */
  restart(): void {
    if (this.connection === 'open') return
    this.failures = 0
    this.connect()
  }

  /** The network is said to be gone; the stream itself may notice much later. */
  interrupt(): void {
    if (this.connection === 'open' || this.connection === 'connecting') this.broken()
  }

  close(): void {
    this.drop()
    this.cancelRetry?.()
    this.cancelTell?.()
  }

  private connect(): void {
    this.drop()
    this.cancelRetry?.()
    const source = this.ports.open(this.last)
    this.source = source
    const heard = (handle: (data: string) => void) => (event: MessageEvent<string>) => {
      // Events of a stream that was given up may still come.
      if (this.source === source) handle(event.data)
    }
    source.addEventListener(
      'open',
      heard(() => this.opened()),
    )
    source.addEventListener(
      'iteration',
      heard((data) => this.arrived(JSON.parse(data))),
    )
    source.addEventListener(
      'state',
      heard((data) => this.moved(JSON.parse(data))),
    )
    source.addEventListener(
      'deleted',
      heard(() => this.deleted()),
    )
    source.addEventListener(
      'error',
      heard(() => this.broken()),
    )
  }

  private opened(): void {
    this.connection = 'open'
    this.staleSince = null
    this.failures = 0
    this.tell()
  }

  private arrived(iteration: Iteration): void {
    const expected = (this.last ?? -1) + 1
    if (iteration.index < expected) return
    if (iteration.index > expected) {
      this.connect()
      return
    }
    this.iterations.push(iteration)
    this.tell()
  }

  private moved(news: { state: JobState; error: string | null; waiting?: string | null }): void {
    this.state = news.state
    this.error = news.error
    this.waiting = news.waiting ?? null
    if (hasEnded(news)) {
      this.connection = 'ended'
      this.staleSince = null
      this.drop()
    }
    this.tell()
  }

  private deleted(): void {
    this.error = 'This job was deleted.'
    this.connection = 'ended'
    this.staleSince = null
    this.drop()
    this.tell()
  }

  private broken(): void {
    this.drop()
    this.connection = 'stale'
    this.staleSince ??= this.ports.now()
    const wait = Math.min(FIRST_WAIT_MS * 2 ** this.failures, LONGEST_WAIT_MS)
    this.failures += 1
    this.cancelRetry?.()
    this.cancelRetry = this.ports.later(() => this.connect(), wait)
    this.tell()
  }

  private drop(): void {
    this.source?.close()
    this.source = null
  }

  private tell(): void {
    if (this.cancelTell) return
    this.cancelTell = this.ports.later(() => {
      this.cancelTell = null
      this.changed({
        iterations: [...this.iterations],
        state: this.state,
        error: this.error,
        waiting: this.waiting,
        connection: this.connection,
        staleSince: this.staleSince,
      })
    }, GATHER_MS)
  }
}
