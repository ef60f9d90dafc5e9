/** What has been chosen with a picker that takes several: one below the other, each removable. */

import type { ComponentChildren } from 'preact'

export function ChosenList({
  ids,
  short = (id) => id,
  children,
  onChange,
}: {
  ids: readonly string[]
  /** What an id is shown as. */
  short?: (id: string) => string
  /** What is known of one, beside its id. */
  children: (id: string) => ComponentChildren
  onChange: (ids: readonly string[]) => void
}) {
  if (ids.length === 0) return null
  return (
    <ul class="stack-tight">
      {ids.map((id) => (
        <li key={id} class="row" data-chosen={id}>
          <span>
            <code>{short(id)}</code> {children(id)}
          </span>
          <button
            type="button"
            class="compact"
            aria-label={`Remove ${short(id)}`}
            onClick={() => onChange(ids.filter((other) => other !== id))}
          >
            Remove
          </button>
        </li>
      ))}
    </ul>
  )
}
