/** Stream of a job's events: every committed iteration once and in order, despite network failures. */

import type { Iteration, JobState } from '../../api/types'
import { hasEnded } from '../facts'

export type Connection = 'connecting' | 'open' | 'stale' | 'ended'

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

export const NOT_CONNECTED: Followed = {
  iterations: [],
  state: null,
  error: null,
  waiting: null,
  connection: 'connecting',
  staleSince: null,
}

export type Source = Pick<EventSource, 'addEventListener' | 'close'>

type Timer = ReturnType<typeof setTimeout>

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
  private followed = NOT_CONNECTED
  private source: Source | null = null
  private failures = 0
  private retry: Timer | undefined
  private report: Timer | undefined

  /**
   * open: opens the stream after an iteration, or from the beginning if null. loaded: iterations from
   * index 0 on; the stream continues after them.
   */
  constructor(
    private readonly open: (after: number | null) => Source,
    private readonly changed: (followed: Followed) => void,
    loaded: readonly Iteration[] = [],
  ) {
    this.iterations = [...loaded]
    this.connect()
  }

  /** Reconnect immediately: after the job continues, or when the network is back. */
  restart(): void {
    if (this.followed.connection === 'open') return
    this.failures = 0
    this.connect()
  }

  /** The browser went offline; the stream itself may notice much later. */
  interrupt(): void {
    if (['open', 'connecting'].includes(this.followed.connection)) this.broken()
  }

  close(): void {
    this.drop()
    clearTimeout(this.report)
  }

  private connect(): void {
    this.drop()
    const last = this.iterations.at(-1)?.index ?? null
    const source = this.open(last)
    this.source = source
    const on = <T>(type: string, handle: (data: T) => void) =>
      source.addEventListener(type, (event) => {
        const { data } = event as MessageEvent<string | undefined>
        // Events of a closed stream may still arrive.
        if (this.source === source) handle(data === undefined ? null : JSON.parse(data))
      })
    on('open', () => {
      this.failures = 0
      this.set({ connection: 'open', staleSince: null })
    })
    on<Iteration>('iteration', (iteration) => {
      const expected = this.iterations.length
      if (iteration.index > expected) return this.connect()
      if (iteration.index < expected) return
      this.iterations.push(iteration)
      this.set({})
    })
    on<Pick<Followed, 'error' | 'waiting'> & { state: JobState }>('state', (update) => {
      const { state, error, waiting = null } = update
      if (hasEnded(update)) this.end({ state, error, waiting })
      else this.set({ state, error, waiting })
    })
    on('deleted', () => this.end({ error: 'The job was deleted.' }))
    on('error', () => this.broken())
  }

  private end(changes: Partial<Followed>): void {
    this.drop()
    this.set({ ...changes, connection: 'ended', staleSince: null })
  }

  private broken(): void {
    this.drop()
    const wait = Math.min(FIRST_WAIT_MS * 2 ** this.failures, LONGEST_WAIT_MS)
    this.failures += 1
    this.retry = setTimeout(() => this.connect(), wait)
    this.set({ connection: 'stale', staleSince: this.followed.staleSince ?? Date.now() })
  }

  private drop(): void {
    clearTimeout(this.retry)
    this.source?.close()
    this.source = null
  }

  private set(changes: Partial<Followed>): void {
    this.followed = { ...this.followed, ...changes }
    this.report ??= setTimeout(() => {
      this.report = undefined
      this.changed({ ...this.followed, iterations: [...this.iterations] })
    }, GATHER_MS)
  }
}
