/** Authentication by token, stored by the browser as a cookie, and its form. */

import { useEffect, useState } from 'preact/hooks'
import { get, onUnauthorized, post } from '../api/client'
import { ErrorNotice } from '../components/feedback'

const IN_FRAGMENT = '#token='

/** Sign in with a token; throws ApiProblem if the server rejects it. */
async function signIn(token: string): Promise<void> {
  await post('/v1/session', { body: { token } })
}

/**
 * Sign in with the token of a link printed by `gaitswarm serve`, before any request. Fragments are not
 * sent to servers or proxies; the token is also removed from the history.
 */
export async function takeTokenOfLink(): Promise<void> {
  if (!location.hash.startsWith(IN_FRAGMENT)) return
  const token = decodeURIComponent(location.hash.slice(IN_FRAGMENT.length))
  history.replaceState(history.state, '', location.pathname + location.search)
  // The sign-in form handles a rejected token.
  await signIn(token).catch(() => undefined)
}

/** Whether a request was rejected for lack of a valid token. */
export function useUnauthorized(): boolean {
  const [rejected, setRejected] = useState(false)
  useEffect(() => onUnauthorized(() => setRejected(true)), [])
  return rejected
}

let manual: Promise<boolean> | null = null

/** Whether the server has the manual at /manual; requested once. */
export function useManual(): boolean {
  const [available, setAvailable] = useState(false)
  useEffect(() => {
    // Without a response, the link is omitted.
    manual ??= get('/v1/session').then(
      (session) => session.manual,
      () => false,
    )
    manual.then(setAvailable)
  }, [])
  return available
}

export function SignIn() {
  const [token, setToken] = useState('')
  const [error, setError] = useState<unknown>(null)
  const submit = async (event: Event) => {
    event.preventDefault()
    try {
      await signIn(token.trim())
      // Repeats all rejected requests.
      location.reload()
    } catch (problem) {
      setError(problem)
    }
  }
  return (
    <form class="sign-in" onSubmit={submit}>
      <h1>Sign in</h1>
      <p>
        This server requires a token. Its owner creates one with{' '}
        <code>gaitswarm token create NAME</code>.
      </p>
      <label>
        Token
        <input
          type="password"
          name="token"
          autocomplete="current-password"
          required
          value={token}
          onInput={(event) => setToken(event.currentTarget.value)}
        />
      </label>
      {error !== null && <ErrorNotice error={error} what="The token was rejected." />}
      <button type="submit">Sign in</button>
    </form>
  )
}
