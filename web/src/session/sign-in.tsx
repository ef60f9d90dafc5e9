/** The form for a token, where the server asks for one. */

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
      // Whatever was refused is asked for anew.
      location.reload()
    } catch (refused) {
      setError(refused)
    }
  }
  return (
    <form class="sign-in" onSubmit={submit}>
      <h1>Sign in</h1>
      <p>
        This server asks for a token. Its owner makes one with{' '}
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
      {error !== null && <ErrorNotice error={error} what="The token was not taken" />}
      <button type="submit">Sign in</button>
    </form>
  )
}
