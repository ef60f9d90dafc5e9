/** Debounced requests of which only the latest counts. */

interface LatestPorts {
  /** Schedule a call; returns the function that cancels it. */
  later(call: () => void, milliseconds: number): () => void
}

const BROWSER: LatestPorts = {
  later: (call, milliseconds) => {
    const timer = setTimeout(call, milliseconds)
    return () => clearTimeout(timer)
  },
}

/** Send the last question after a pause without another one; abort and drop older requests. */
export class LatestAnswer<Q, A> {
  private cancel: (() => void) | null = null
  private abort: AbortController | null = null

  constructor(
    private readonly send: (question: Q, signal: AbortSignal) => Promise<A>,
    private readonly onAnswer: (answer: A) => void,
    private readonly onError: (error: unknown) => void,
    /** Pause before a question is sent [ms]. */
    private readonly pause = 50,
    private readonly ports = BROWSER,
  ) {}

  ask(question: Q): void {
    this.stop()
    this.cancel = this.ports.later(() => {
      const abort = new AbortController()
      this.abort = abort
      this.send(question, abort.signal).then(
        (answer) => {
          if (!abort.signal.aborted) this.onAnswer(answer)
        },
        (error: unknown) => {
          if (!abort.signal.aborted) this.onError(error)
        },
      )
    }, this.pause)
  }

  stop(): void {
    this.cancel?.()
    this.abort?.abort()
  }
}
