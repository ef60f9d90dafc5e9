/** Visibility of an element. */

import type { RefObject } from 'preact'
import { useEffect, useState } from 'preact/hooks'

export function useVisible(element: RefObject<Element | null>): boolean {
  const [visible, setVisible] = useState(false)
  useEffect(() => {
    if (!element.current) return
    const observer = new IntersectionObserver(([entry]) => setVisible(entry.isIntersecting))
    observer.observe(element.current)
    return () => observer.disconnect()
  }, [])
  return visible
}
