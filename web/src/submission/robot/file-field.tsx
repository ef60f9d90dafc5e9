/** A file input; choosing the same file again reads it again. */

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
  /** Whether the file is required. */
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
