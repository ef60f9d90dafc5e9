/** Notification of changes, and values that components follow. */

import { useEffect, useState } from 'preact/hooks'

export class Changes {
  private readonly listeners = new Set<() => void>()

  /** Returns the unsubscribe function. */
  subscribe(listener: () => void): () => void {
    this.listeners.add(listener)
    return () => {
      this.listeners.delete(listener)
    }
  }

  notify(): void {
    for (const listener of [...this.listeners]) listener()
  }
}

/** A value that is read again after every change. */
export function useFollowed<T>(changes: Changes, read: () => T): T {
  const [value, setValue] = useState(read)
  useEffect(() => {
    const update = () => setValue(read)
    update()
    return changes.subscribe(update)
  }, [])
  return value
}
