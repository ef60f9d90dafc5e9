/** Whether the server knows who asks: a token that it asks for, kept as a cookie by the browser. */

import { useEffect, useState } from 'preact/hooks'
import { get, onUnauthorized, post } from '../api/client'

const IN_FRAGMENT = '#token='

/** Ask with a token from now on; throws ApiProblem if the server does not take it. */
export async function signIn(token: string): Promise<void> {
  await post('/v1/session', { body: { token } })
}

/**
 * Take the token of a link that `gaitswarm serve` printed, before anything is asked. Fragments are
 * never sent, so that no log of a server or proxy has it; nor is it to stay in the history.
 */
export async function takeTokenOfLink(): Promise<void> {
  if (!location.hash.startsWith(IN_FRAGMENT)) return
  const token = decodeURIComponent(location.hash.slice(IN_FRAGMENT.length))
  history.replaceState(history.state, '', location.pathname + location.search)
  // One that is refused is asked for by the form.
  await signIn(token).catch(() => undefined)
}

/** Whether the server has refused a request of this page for want of a valid token. */
export function useUnauthorized(): boolean {
  const [refused, setRefused] = useState(false)
  useEffect(() => onUnauthorized(() => setRefused(true)), [])
  return refused
}

let manual: Promise<boolean> | null = null

/** Whether this server has the manual at /manual; asked once. */
export function useManual(): boolean {
  const [there, setThere] = useState(false)
  useEffect(() => {
    // Without an answer there is no link, which is all that is lost.
    manual ??= get('/v1/session').then(
      (session) => session.manual,
      () => false,
    )
    manual.then(setThere)
  }, [])
  return there
}
