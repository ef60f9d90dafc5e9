/** A file to choose; the same one again is read again. */

import { useId } from 'preact/hooks'

export function FileField({
  label,
  accept,
  hint,
  missing = false,
  onFile,
}: {
  label: string
  accept: string
  hint: string
  /** Whether nothing can go on without it. */
  missing?: boolean
  onFile: (file: File) => void
}) {
  const id = useId()
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <input
        id={id}
        type="file"
        accept={accept}
        aria-invalid={missing}
        aria-describedby={`${id}-hint`}
        onClick={(event) => {
          event.currentTarget.value = ''
        }}
        onChange={(event) => {
          const file = event.currentTarget.files?.[0]
          if (file) onFile(file)
        }}
      />
      <span id={`${id}-hint`} class="hint">
        {hint}
      </span>
    </div>
  )
}
