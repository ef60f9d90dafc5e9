/** Sign-in form. */

import { useState } from 'preact/hooks'
import { ErrorNotice } from '../components/feedback'
import { signIn } from './session'

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
