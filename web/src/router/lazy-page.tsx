/** Code splitting: components loaded when first shown. */

import type { FunctionComponent } from 'preact'
import { useEffect, useState } from 'preact/hooks'
import { ErrorNotice, Loading } from '../components/feedback'

/** Wrap a module's default export. what: as in "Loading the walk". */
export function lazyPage<P extends object>(
  what: string,
  load: () => Promise<{ default: FunctionComponent<P> }>,
): FunctionComponent<P> {
  let loaded: FunctionComponent<P> | null = null
  return function LazyPage(props: P) {
    const [Page, setPage] = useState<FunctionComponent<P> | null>(() => loaded)
    const [error, setError] = useState<unknown>(null)
    useEffect(() => {
      if (loaded) return
      load().then((module) => {
        loaded = module.default
        setPage(() => module.default)
      }, setError)
    }, [])
    useEffect(() => (error === null ? undefined : reloadOnceBack()), [error])
    if (error !== null) {
      return (
        <ErrorNotice
          what={`Could not load the code of ${what}.`}
          error={error}
          retry={() => location.reload()}
        />
      )
    }
    return Page ? <Page {...props} /> : <Loading what={what} />
  }
}

const PROBE_MS = 2000
const RELOADED = 'gaitswarm-reloaded'
const RELOAD_INTERVAL_MS = 60_000

/** Reload once the server responds; browsers and the bundler remember files that failed. */
function reloadOnceBack(): () => void {
  let lost = false
  const respond = () => {
    // A file that is missing after a reload as well stays missing.
    if (!lost && Date.now() - Number(sessionStorage.getItem(RELOADED)) < RELOAD_INTERVAL_MS) return
    sessionStorage.setItem(RELOADED, String(Date.now()))
    location.reload()
  }
  const probe = () =>
    fetch(location.href, { method: 'HEAD' }).then(respond, () => {
      lost = true
    })
  probe()
  const timer = setInterval(probe, PROBE_MS)
  return () => clearInterval(timer)
}
