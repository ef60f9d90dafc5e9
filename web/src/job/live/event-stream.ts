/** Stream of a job's events: every committed iteration once and in order, despite network failures. */

import type { Iteration, JobState } from '../../api/types'
import { hasEnded } from '../state'

export type Connection = 'connecting' | 'open' | 'stale' | 'ended'

/** State of a job as received from its events. */
export interface Followed {
  /** Consecutive, from index 0. */
  readonly iterations: readonly Iteration[]
  readonly state: JobState | null
  readonly error: string | null
  /** Reason for waiting, such as unavailable workers. */
  readonly waiting: string | null
  readonly connection: Connection
  /** Time at which the stream broke [ms]; null while it is connected. */
  readonly staleSince: number | null
}

/** The subset of EventSource in use. */
export interface Source {
  addEventListener(type: string, listener: (event: MessageEvent<string>) => void): void
  close(): void
}

export interface StreamPorts {
  /** Open the stream after an iteration; from the beginning if null. */
  open(after: number | null): Source
  now(): number
  /** Schedule a call; returns the function that cancels it. */
  later(call: () => void, milliseconds: number): () => void
}

const FIRST_WAIT_MS = 500
const LONGEST_WAIT_MS = 8000
/** Events within this time are reported together. */
const GATHER_MS = 40

/**
 * Follows one job.
 *
 * | event | reaction |
 * | --- | --- |
 * | next iteration | append it |
 * | duplicate iteration | drop it |
 * | later iteration | reconnect after the last one, to fill the gap |
 * | connection lost | stale; reconnect after the last iteration, with exponential backoff |
 * | job deleted | ended |
 * | final state | ended; `restart` follows a job that was resumed or extended |
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
  private cancelNotify: (() => void) | null = null

  constructor(
    private readonly ports: StreamPorts,
    private readonly changed: (followed: Followed) => void,
    /** Iterations already loaded, from index 0; the stream continues after them. */
    loaded: readonly Iteration[] = [],
  ) {
    this.iterations = [...loaded]
    this.connect()
  }

  /** Index of the last iteration; null before the first. */
  get last(): number | null {
    return this.iterations.at(-1)?.index ?? null
  }

  /** Reconnect immediately: after the job continues, or when the network is back. */
  restart(): void {
    if (this.connection === 'open') return
    this.failures = 0
    this.connect()
  }

  /** The browser went offline; the stream itself may notice much later. */
  interrupt(): void {
    if (this.connection === 'open' || this.connection === 'connecting') this.broken()
  }

  close(): void {
    this.drop()
    this.cancelRetry?.()
    this.cancelNotify?.()
  }

  private connect(): void {
    this.drop()
    this.cancelRetry?.()
    const source = this.ports.open(this.last)
    this.source = source
    const ifCurrent = (handle: (data: string) => void) => (event: MessageEvent<string>) => {
      // Events of a closed stream may still arrive.
      if (this.source === source) handle(event.data)
    }
    source.addEventListener(
      'open',
      ifCurrent(() => this.opened()),
    )
    source.addEventListener(
      'iteration',
      ifCurrent((data) => this.arrived(JSON.parse(data))),
    )
    source.addEventListener(
      'state',
      ifCurrent((data) => this.stateChanged(JSON.parse(data))),
    )
    source.addEventListener(
      'deleted',
      ifCurrent(() => this.deleted()),
    )
    source.addEventListener(
      'error',
      ifCurrent(() => this.broken()),
    )
  }

  private opened(): void {
    this.connection = 'open'
    this.staleSince = null
    this.failures = 0
    this.notify()
  }

  private arrived(iteration: Iteration): void {
    const expected = (this.last ?? -1) + 1
    if (iteration.index < expected) return
    if (iteration.index > expected) {
      this.connect()
      return
    }
    this.iterations.push(iteration)
    this.notify()
  }

  private stateChanged(update: {
    state: JobState
    error: string | null
    waiting?: string | null
  }): void {
    this.state = update.state
    this.error = update.error
    this.waiting = update.waiting ?? null
    if (hasEnded(update)) {
      this.connection = 'ended'
      this.staleSince = null
      this.drop()
    }
    this.notify()
  }

  private deleted(): void {
    this.error = 'The job was deleted.'
    this.connection = 'ended'
    this.staleSince = null
    this.drop()
    this.notify()
  }

  private broken(): void {
    this.drop()
    this.connection = 'stale'
    this.staleSince ??= this.ports.now()
    const wait = Math.min(FIRST_WAIT_MS * 2 ** this.failures, LONGEST_WAIT_MS)
    this.failures += 1
    this.cancelRetry?.()
    this.cancelRetry = this.ports.later(() => this.connect(), wait)
    this.notify()
  }

  private drop(): void {
    this.source?.close()
    this.source = null
  }

  private notify(): void {
    if (this.cancelNotify) return
    this.cancelNotify = this.ports.later(() => {
      this.cancelNotify = null
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
