/** Named filters and orders of the job list, stored in this browser. */

import { useRef, useState } from 'preact/hooks'

const KEY = 'gaitswarm.views'

/** Query strings by name. */
type Views = Readonly<Record<string, string>>

function storedViews(): Views {
  try {
    return { ...(JSON.parse(localStorage.getItem(KEY) ?? '{}') as Views) }
  } catch {
    return {}
  }
}

export function SavedViews({ query }: { query: URLSearchParams }) {
  const [views, setViews] = useState(storedViews)
  const bar = useRef<HTMLElement>(null)
  const shown = new URLSearchParams(query)
  shown.delete('after')
  shown.sort()
  const current = shown.toString()
  const change = (entries: readonly (readonly [name: string, query: string])[]) => {
    localStorage.setItem(KEY, JSON.stringify(Object.fromEntries(entries)))
    setViews(storedViews)
    // The control in use disappears.
    bar.current?.focus()
  }
  const entries = Object.entries(views)
  const canSave = current !== '' && !Object.values(views).includes(current)
  if (entries.length === 0 && !canSave) return null
  return (
    <nav class="row filters" aria-label="Saved views" ref={bar} tabIndex={-1}>
      {entries.map(([name, saved]) => (
        <span key={name} class="nowrap">
          <a href={`/jobs?${saved}`} aria-current={saved === current ? 'page' : undefined}>
            {name}
          </a>
          <button
            type="button"
            class="compact plain"
            aria-label={`Remove view ${name}`}
            onClick={() => change(entries.filter(([each]) => each !== name))}
          >
            ×
          </button>
        </span>
      ))}
      {canSave && (
        <form
          class="row"
          onSubmit={(event) => {
            event.preventDefault()
            const name = String(new FormData(event.currentTarget).get('name')).trim()
            change([...entries, [name, current]])
          }}
        >
          <input
            name="name"
            aria-label="Name of the view"
            placeholder="Name of the view"
            required
            pattern=".*\S.*"
            maxLength={40}
          />
          <button type="submit" class="compact">
            Save view
          </button>
        </form>
      )}
    </nav>
  )
}
