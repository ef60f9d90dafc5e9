/** Parts of an address that could not be read: they change nothing, and are told. */

import { useEffect, useState } from 'preact/hooks'

type Listener = () => void

const found = new Map<string, string>()
const listeners = new Set<Listener>()

/** text: what the address says. */
export function ignore(name: string, text: string): void {
  found.set(name, text)
  tell()
}

export function forgetIgnored(): void {
  if (found.size === 0) return
  found.clear()
  tell()
}

export function IgnoredNotice() {
  const [parts, setParts] = useState(() => [...found])
  useEffect(() => {
    const update = () => setParts([...found])
    listeners.add(update)
    update()
    return () => {
      listeners.delete(update)
    }
  }, [])
  if (parts.length === 0) return null
  return (
    <div class="notice" data-tone="warn" role="status">
      <p>
        Part of this address could not be read and is ignored:{' '}
        {parts.map(([name, text], k) => (
          <span key={name}>
            {k > 0 && ', '}
            <code>
              {name}={text.slice(0, 60)}
            </code>
          </span>
        ))}
        .
      </p>
    </div>
  )
}

function tell(): void {
  for (const listener of [...listeners]) listener()
}
