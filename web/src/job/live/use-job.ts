/** One job, live: its events, and the rest of it asked for again whenever they tell news. */

import { useCallback, useEffect, useRef, useState } from 'preact/hooks'
import { get, url } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import type { Iteration, StoredJob } from '../../api/types'
import { EventStream, type Followed, type Source } from './event-stream'

export interface LiveJob {
  readonly job: StoredJob | null
  readonly error: unknown
  readonly followed: Followed
  /** Show what a command answered, and follow the job if it goes on. */
  readonly replace: (job: StoredJob) => void
  readonly reload: () => void
  /** Nothing is asked of the job until `hold(false)`: of one that is being deleted, say. */
  readonly held: boolean
  readonly hold: (held: boolean) => void
}

const NOTHING_YET: Followed = {
  iterations: [],
  state: null,
  error: null,
  waiting: null,
  connection: 'connecting',
  staleSince: null,
}

/** Iterations that are asked for first, so that there is something to see at once, and then. */
const FIRST = 100
const FURTHER = 1000

/** Rates and times are worth a question at most this often [ms]. */
const ASK_MS = 1000

export function useJob(id: string): LiveJob {
  const [job, setJob] = useState<StoredJob | null>(null)
  const [error, setError] = useState<unknown>(null)
  const [followed, setFollowed] = useState<Followed>(NOTHING_YET)
  const stream = useRef<EventStream | null>(null)
  const asked = useRef(0)
  const missing = useRef(false)
  // Questions and commands are numbered: what was asked before the job that is shown is no news.
  const sent = useRef(0)
  const shown = useRef(0)
  // Ends what is asked when nobody wants the answer any more; null while the job is held.
  const questions = useRef<AbortController | null>(null)
  const [held, setHeld] = useState(false)

  const ask = useCallback(() => {
    const signal = questions.current?.signal
    if (!signal) return
    asked.current = Date.now()
    const question = ++sent.current
    const isNews = () => {
      if (signal.aborted || question < shown.current) return false
      shown.current = question
      return true
    }
    get('/v1/jobs/{job_id}', { path: { job_id: id }, signal }).then(
      (answer) => {
        if (!isNews()) return
        setJob(answer)
        setError(null)
      },
      (problem: unknown) => {
        if (!isNews()) return
        setError(problem)
        // There is nothing to follow, and asking again does not help.
        missing.current = problem instanceof ApiProblem && problem.status === 404
        if (missing.current) stream.current?.close()
      },
    )
  }, [id])

  const stop = useCallback(() => {
    questions.current?.abort()
    questions.current = null
    stream.current?.close()
    stream.current = null
  }, [])

  useEffect(() => {
    if (held) return
    const abort = new AbortController()
    const { signal } = abort
    questions.current = abort
    ask()
    const show = (iterations: readonly Iteration[]) => {
      if (!signal.aborted) setFollowed({ ...NOTHING_YET, iterations })
    }
    committedSoFar(id, show, signal).then((known) => {
      if (signal.aborted || missing.current) return
      stream.current = new EventStream(browserPorts(id), setFollowed, known)
    })
    const back = () => stream.current?.restart()
    const gone = () => stream.current?.interrupt()
    addEventListener('online', back)
    addEventListener('offline', gone)
    return () => {
      removeEventListener('online', back)
      removeEventListener('offline', gone)
      stop()
    }
  }, [id, held])

  // A new state is asked about at once, new iterations now and then.
  useEffect(() => {
    if (followed.state !== null) ask()
  }, [followed.state, followed.waiting, followed.connection])
  useEffect(() => {
    if (followed.iterations.length === 0) return
    const wait = Math.max(0, asked.current + ASK_MS - Date.now())
    const timer = setTimeout(ask, wait)
    return () => clearTimeout(timer)
  }, [followed.iterations.length])

  const replace = useCallback((answer: StoredJob) => {
    shown.current = ++sent.current
    setJob(answer)
    stream.current?.restart()
  }, [])
  const hold = useCallback((wanted: boolean) => {
    // At once, not after the next drawing: the answer to what is under way may be that it is gone.
    if (wanted) stop()
    setHeld(wanted)
  }, [])
  return { job, error, followed, replace, reload: ask, held, hold }
}

/** Thousands of iterations come faster in pages than as events; if not all come, the stream does. */
async function committedSoFar(
  id: string,
  show: (iterations: readonly Iteration[]) => void,
  signal: AbortSignal,
): Promise<readonly Iteration[]> {
  const known: Iteration[] = []
  try {
    for (;;) {
      const page = await get('/v1/jobs/{job_id}/iterations', {
        path: { job_id: id },
        query: { after: known.at(-1)?.index, limit: known.length === 0 ? FIRST : FURTHER },
        signal,
      })
      known.push(...page.items)
      show([...known])
      if (page.next === null) return known
    }
  } catch {
    return known
  }
}

function browserPorts(id: string) {
  const path = '/v1/jobs/{job_id}/events'
  return {
    open: (after: number | null): Source =>
      new EventSource(url(path, { job_id: id }, { after })) as Source,
    now: () => Date.now(),
    later: (call: () => void, milliseconds: number) => {
      const timer = setTimeout(call, milliseconds)
      return () => clearTimeout(timer)
    },
  }
}
