/** Confirmation dialog. */

import type { ComponentChildren } from 'preact'
import { useEffect, useId, useRef } from 'preact/hooks'

export function ConfirmDialog({
  open,
  title,
  confirm,
  dismiss = 'Back',
  dangerous = false,
  disabled = false,
  onConfirm,
  onDismiss,
  children,
}: {
  open: boolean
  title: string
  /** Label of the confirming button. */
  confirm: string
  dismiss?: string
  dangerous?: boolean
  disabled?: boolean
  onConfirm: () => void
  onDismiss: () => void
  children: ComponentChildren
}) {
  const dialog = useRef<HTMLDialogElement>(null)
  const heading = useId()
  useEffect(() => {
    const element = dialog.current
    if (!element) return
    if (open && !element.open) element.showModal()
    if (!open && element.open) element.close()
  }, [open])
  return (
    <dialog ref={dialog} aria-labelledby={heading} onClose={() => open && onDismiss()}>
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
            {dismiss}
          </button>
          <button type="submit" class={dangerous ? 'danger' : 'primary'} disabled={disabled}>
            {confirm}
          </button>
        </div>
      </form>
    </dialog>
  )
}
