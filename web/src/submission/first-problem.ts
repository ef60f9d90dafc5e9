/** Focus on the first invalid field after a rejected submission. */

import { useEffect } from 'preact/hooks'

/** Only after submissions: an estimate's problems must not move the focus while the user types. */
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
