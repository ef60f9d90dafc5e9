/** A job as live component state: its event stream, and its other fields by polling. */

import { useCallback, useEffect, useRef, useState } from 'preact/hooks'
import { get, url } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import type { Iteration, StoredJob } from '../../api/types'
import { EventStream, type Followed, NOT_CONNECTED } from './event-stream'

export type LiveJob = ReturnType<typeof useJob>

/** Page sizes: a small first page, to show something early, and larger ones after it. */
const FIRST = 100
const FURTHER = 1000

const REQUEST_MS = 1000

/**
 * replace: shows the response to a command, and follows the job if it continues. held: whether all
 * requests are suspended, for example during deletion.
 */
export function useJob(id: string) {
  const [job, setJob] = useState<StoredJob | null>(null)
  const [error, setError] = useState<unknown>(null)
  const [followed, setFollowed] = useState<Followed>(NOT_CONNECTED)
  const stream = useRef<EventStream | null>(null)
  const lastRequest = useRef(0)
  const missing = useRef(false)
  // Requests and commands are numbered; a response older than the job shown is dropped.
  const sent = useRef(0)
  const shown = useRef(0)
  // Aborts requests in flight; null while suspended.
  const abortController = useRef<AbortController | null>(null)
  const [held, setHeld] = useState(false)

  const refresh = useCallback(() => {
    const signal = abortController.current?.signal
    if (!signal) return
    lastRequest.current = Date.now()
    const request = ++sent.current
    const isNewer = () => {
      if (signal.aborted || request < shown.current) return false
      shown.current = request
      return true
    }
    get('/v1/jobs/{job_id}', { path: { job_id: id }, signal }).then(
      (current) => {
        if (!isNewer()) return
        setJob(current)
        setError(null)
      },
      (problem: unknown) => {
        if (!isNewer()) return
        setError(problem)
        // A missing job will not appear; stop following it.
        missing.current = problem instanceof ApiProblem && problem.status === 404
        if (missing.current) stream.current?.close()
      },
    )
  }, [id])

  const stop = useCallback(() => {
    abortController.current?.abort()
    abortController.current = null
    stream.current?.close()
    stream.current = null
  }, [])

  useEffect(() => {
    if (held) return
    const abort = new AbortController()
    const { signal } = abort
    abortController.current = abort
    refresh()
    const show = (iterations: readonly Iteration[]) => {
      if (!signal.aborted) setFollowed({ ...NOT_CONNECTED, iterations })
    }
    committedSoFar(id, show, signal).then((loaded) => {
      if (signal.aborted || missing.current) return
      const open = (after: number | null) =>
        new EventSource(url('/v1/jobs/{job_id}/events', { job_id: id }, { after }))
      stream.current = new EventStream(open, setFollowed, loaded)
    })
    const online = () => stream.current?.restart()
    const offline = () => stream.current?.interrupt()
    addEventListener('online', online)
    addEventListener('offline', offline)
    return () => {
      removeEventListener('online', online)
      removeEventListener('offline', offline)
      stop()
    }
  }, [id, held])

  // Refresh at once on a new state, and at intervals on new iterations.
  useEffect(() => {
    if (followed.state !== null) refresh()
  }, [followed.state, followed.waiting, followed.connection])
  useEffect(() => {
    if (followed.iterations.length === 0) return
    const wait = Math.max(0, lastRequest.current + REQUEST_MS - Date.now())
    const timer = setTimeout(refresh, wait)
    return () => clearTimeout(timer)
  }, [followed.iterations.length])

  const replace = useCallback((current: StoredJob) => {
    shown.current = ++sent.current
    setJob(current)
    stream.current?.restart()
  }, [])
  const hold = useCallback((suspended: boolean) => {
    // Immediately, not after the next render: a request in flight may find the job deleted.
    if (suspended) stop()
    setHeld(suspended)
  }, [])
  return { job, error, missing: missing.current, followed, replace, reload: refresh, held, hold }
}

/** Load committed iterations in pages, faster than as events; on failure the stream has the rest. */
async function committedSoFar(
  id: string,
  show: (iterations: readonly Iteration[]) => void,
  signal: AbortSignal,
): Promise<readonly Iteration[]> {
  const loaded: Iteration[] = []
  try {
    for (;;) {
      const page = await get('/v1/jobs/{job_id}/iterations', {
        path: { job_id: id },
        query: { after: loaded.at(-1)?.index, limit: loaded.length === 0 ? FIRST : FURTHER },
        signal,
      })
      loaded.push(...page.items)
      show([...loaded])
      if (page.next === null) return loaded
    }
  } catch {
    return loaded
  }
}
