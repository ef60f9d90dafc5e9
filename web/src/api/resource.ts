/** API responses as component state. */

import { useCallback, useEffect, useRef, useState } from 'preact/hooks'
import { isOffline } from './problem'

/** A pending, received or failed response; `data` is kept during a reload. */
export interface Resource<T> {
  readonly data: T | null
  readonly error: Error | null
  readonly loading: boolean
  readonly reload: () => void
}

interface Options {
  /** Whether a response stays until that of the next key arrives. */
  readonly keep?: boolean
  /** Time without another key before a request is sent [ms]. */
  readonly pause?: number
}

const RETRY_MS = 3000

/** Fetch when `key` changes, dropping outdated responses; a null key fetches nothing. */
export function useResource<T>(
  key: string | null,
  load: (signal: AbortSignal) => Promise<T>,
  { keep = false, pause = 0 }: Options = {},
): Resource<T> {
  const [state, setState] = useState<Omit<Resource<T>, 'reload'> & { key: string | null }>({
    data: null,
    error: null,
    loading: key !== null,
    key,
  })
  const [turn, setTurn] = useState(0)
  const latest = useRef(load)
  latest.current = load
  useEffect(() => {
    if (key === null) {
      setState({ data: null, error: null, loading: false, key })
      return
    }
    const abort = new AbortController()
    setState((s) => ({
      data: keep || s.key === key ? s.data : null,
      error: keep || isOffline(s.error) ? s.error : null,
      loading: true,
      key,
    }))
    const send = () =>
      latest.current(abort.signal).then(
        (data) => {
          if (!abort.signal.aborted) setState({ data, error: null, loading: false, key })
        },
        (error: unknown) => {
          if (abort.signal.aborted) return
          const shown = error instanceof Error ? error : new Error(String(error))
          setState((s) => ({ ...s, error: shown, loading: false, key }))
        },
      )
    const timer = pause > 0 ? setTimeout(send, pause) : void send()
    return () => {
      clearTimeout(timer)
      abort.abort()
    }
  }, [key, turn])
  // Without a connection, repeat the request until there is one.
  useEffect(() => {
    if (!isOffline(state.error)) return
    const timer = setTimeout(() => setTurn((n) => n + 1), RETRY_MS)
    return () => clearTimeout(timer)
  }, [state.error])
  const reload = useCallback(() => setTurn((n) => n + 1), [])
  return { data: state.data, error: state.error, loading: state.loading, reload }
}

/** State of a command: whether it runs, and its error. */
export function useCommand() {
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const during = (work: Promise<unknown>) => {
    setBusy(true)
    setError(null)
    work.catch(setError).finally(() => setBusy(false))
  }
  return { busy, error, setError, during }
}

/** Call `tick` every `milliseconds` while the tab is visible, and as soon as it becomes visible. */
export function usePolling(tick: () => void, milliseconds: number, active = true): void {
  const latest = useRef(tick)
  latest.current = tick
  useEffect(() => {
    if (!active) return
    const call = () => {
      if (!document.hidden) latest.current()
    }
    const timer = setInterval(call, milliseconds)
    document.addEventListener('visibilitychange', call)
    return () => {
      clearInterval(timer)
      document.removeEventListener('visibilitychange', call)
    }
  }, [milliseconds, active])
}

/** The current time [ms], updated every `milliseconds` while the tab is visible. */
export function useNow(milliseconds = 1000): number {
  const [now, setNow] = useState(Date.now)
  usePolling(() => setNow(Date.now()), milliseconds)
  return now
}

/** Follow a number, at most once per `milliseconds`. */
export function useSlowly(value: number, milliseconds: number): number {
  const [shown, setShown] = useState(value)
  const changed = useRef(0)
  useEffect(() => {
    if (value === shown) return
    const wait = shown === 0 ? 0 : Math.max(0, changed.current + milliseconds - Date.now())
    const timer = setTimeout(() => {
      changed.current = Date.now()
      setShown(value)
    }, wait)
    return () => clearTimeout(timer)
  }, [value, shown, milliseconds])
  return shown
}

const responses = new Map<string, Promise<unknown>>()

/** The response to a request that was sent before, since the page was loaded; failures are repeated. */
export function cached<T>(key: string, request: () => Promise<T>): Promise<T> {
  const response = (responses.get(key) as Promise<T> | undefined) ?? request()
  responses.set(key, response)
  response.catch(() => responses.delete(key))
  return response
}
