/** Questions that come faster than answers: only the last one counts. */

interface LatestPorts {
  /** Call back after some time [ms]; returns what cancels it. */
  later(call: () => void, milliseconds: number): () => void
}

const BROWSER: LatestPorts = {
  later: (call, milliseconds) => {
    const timer = setTimeout(call, milliseconds)
    return () => clearTimeout(timer)
  },
}

/**
 * | event | what happens |
 * | --- | --- |
 * | ask | after a pause without another question, it is sent; an older one is given up |
 * | an answer | told, if no newer question was asked meanwhile |
 */
export class LatestAnswer<Q, A> {
  private cancel: (() => void) | null = null
  private abort: AbortController | null = null

  constructor(
    private readonly send: (question: Q, signal: AbortSignal) => Promise<A>,
    private readonly told: (answer: A) => void,
    private readonly failed: (error: unknown) => void,
    /** Pause after which a question is sent [ms]. */
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
          if (!abort.signal.aborted) this.told(answer)
        },
        (error: unknown) => {
          if (!abort.signal.aborted) this.failed(error)
        },
      )
    }, this.pause)
  }

  /** Whatever was asked is of no interest any more. */
  stop(): void {
    this.cancel?.()
    this.abort?.abort()
  }
}
