/** After a refused submission the first field that is to blame takes the focus. */

import { useEffect } from 'preact/hooks'

/** Not for what an estimate has against the spec: whoever types keeps the focus. */
export function useFirstProblem(attempts: number): void {
  useEffect(() => {
    if (attempts > 0) requestAnimationFrame(show)
  }, [attempts])
}

function show(): void {
  const field = document.querySelector<HTMLElement>('.submission [aria-invalid="true"]')
  if (field) field.focus()
  else document.querySelector('.submission [role="alert"]')?.scrollIntoView({ block: 'center' })
}
