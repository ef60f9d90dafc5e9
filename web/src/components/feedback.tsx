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

interface EmptyProps {
  title: string
  /** Of the title: 1 if nothing else is on the page. */
  level?: 1 | 2
  children?: ComponentChildren
}

/** Nothing to show yet; children explain how to change that. */
export function Empty({ title, level = 2, children }: EmptyProps) {
  const Heading = `h${level}` as const
  return (
    <div class="empty">
      <Heading>{title}</Heading>
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
