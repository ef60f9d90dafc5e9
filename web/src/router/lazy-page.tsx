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
