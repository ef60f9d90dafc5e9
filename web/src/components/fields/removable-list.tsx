/** Removable list of the items selected with a picker. */

import type { ComponentChildren } from 'preact'

interface RemovableListProps {
  ids: readonly string[]
  short?: (id: string) => string
  children: (id: string) => ComponentChildren
  onChange: (ids: readonly string[]) => void
}

export function RemovableList({ ids, short = (id) => id, children, onChange }: RemovableListProps) {
  if (ids.length === 0) return null
  return (
    <ul class="stack-tight">
      {ids.map((id) => (
        <li key={id} class="row" data-item={id}>
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
