/** Loading, empty and error states. */

import type { ComponentChildren } from 'preact'
import { ApiProblem, messageOf } from '../api/problem'
import { sentence } from '../format/words'

export function Loading({ what }: { what: string }) {
  return (
    <div class="loading" role="status">
      Loading {what}…
    </div>
  )
}

/** Nothing to show yet; children explain how to change that. */
export function Empty({ title, children }: { title: string; children?: ComponentChildren }) {
  return (
    <div class="empty">
      <h2>{title}</h2>
      {children}
    </div>
  )
}

interface ErrorNoticeProps {
  error: unknown
  /** Short summary, such as "Could not load the jobs." */
  what: string
  retry?: () => void
}

export function ErrorNotice({ error, what, retry }: ErrorNoticeProps) {
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

function isFinal(error: unknown): boolean {
  return error instanceof ApiProblem && error.status === 422
}
