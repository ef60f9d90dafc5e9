/** What a page shows while it has nothing to show. */

import type { ComponentChildren } from 'preact'
import { ApiProblem, messageOf } from '../api/problem'
import { sentence } from '../format/words'

/** Something is on its way. */
export function Loading({ what }: { what: string }) {
  return (
    <div class="loading" role="status">
      Loading {what}…
    </div>
  )
}

/** There is nothing yet; children say what to do about it. */
export function Empty({ title, children }: { title: string; children?: ComponentChildren }) {
  return (
    <div class="empty">
      <h2>{title}</h2>
      {children}
    </div>
  )
}

/** Something failed: what, why, and a button to try again where that may help. */
export function ErrorNotice({
  error,
  what,
  retry,
}: {
  error: unknown
  /** What could not be done, as in "the jobs cannot be shown". */
  what: string
  retry?: () => void
}) {
  const fields = error instanceof ApiProblem ? error.errors.filter((e) => e.field !== '') : []
  return (
    <div class="notice" data-tone="bad" role="alert">
      <strong>{what}</strong>
      {fields.length > 0 ? (
        <ul>
          {fields.map((e) => (
            <li key={e.field + e.message}>
              <code>{e.field}</code>: {e.message}
            </li>
          ))}
        </ul>
      ) : (
        <p>{sentence(messageOf(error))}</p>
      )}
      {retry && !isFinal(error) && (
        <p>
          <button type="button" class="compact" onClick={retry}>
            Try again
          </button>
        </p>
      )}
    </div>
  )
}

/** Whether asking the same again gets the same answer. */
function isFinal(error: unknown): boolean {
  return error instanceof ApiProblem && error.status === 422
}
