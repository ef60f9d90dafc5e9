/** Notice about invalid query parameters, which are ignored. */

import { useEffect, useState } from 'preact/hooks'

type Listener = () => void

const ignored = new Map<string, string>()
const listeners = new Set<Listener>()

/** text: the invalid value. */
export function ignore(name: string, text: string): void {
  ignored.set(name, text)
  notify()
}

export function forgetIgnored(): void {
  if (ignored.size === 0) return
  ignored.clear()
  notify()
}

export function IgnoredNotice() {
  const [parts, setParts] = useState(() => [...ignored])
  useEffect(() => {
    const update = () => setParts([...ignored])
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
        Part of this address is invalid and was ignored:{' '}
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

function notify(): void {
  for (const listener of [...listeners]) listener()
}
