/** Confirmation dialog, open while it is rendered. */

import type { ComponentChildren } from 'preact'
import { useEffect, useId, useRef } from 'preact/hooks'

export function ConfirmDialog({
  title,
  confirm = title,
  dangerous = false,
  disabled = false,
  onConfirm,
  onDismiss,
  children,
}: {
  title: string
  confirm?: string
  dangerous?: boolean
  disabled?: boolean
  onConfirm: () => void
  onDismiss: () => void
  children: ComponentChildren
}) {
  const dialog = useRef<HTMLDialogElement>(null)
  const heading = useId()
  useEffect(() => {
    const element = dialog.current!
    element.showModal()
    // Returns the focus to where it was.
    return () => element.close()
  }, [])
  return (
    <dialog ref={dialog} aria-labelledby={heading} onClose={onDismiss}>
      <form
        method="dialog"
        onSubmit={(event) => {
          event.preventDefault()
          onConfirm()
        }}
      >
        <h2 id={heading}>{title}</h2>
        <div class="stack-tight">{children}</div>
        <div class="actions">
          <button type="button" onClick={onDismiss}>
            Back
          </button>
          <button type="submit" class={dangerous ? 'danger' : 'primary'} disabled={disabled}>
            {confirm}
          </button>
        </div>
      </form>
    </dialog>
  )
}
