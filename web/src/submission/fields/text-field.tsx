/** A labelled text field with a hint or an error. */

import { useId } from 'preact/hooks'
import './fields.css'

export function TextField({
  label,
  value,
  hint,
  error,
  wide = false,
  onChange,
}: {
  label: string
  value: string
  hint?: string
  error?: string
  wide?: boolean
  onChange: (value: string) => void
}) {
  const id = useId()
  return (
    <div class={wide ? 'field wide' : 'field'}>
      <label for={id}>{label}</label>
      <input
        id={id}
        value={value}
        aria-invalid={error !== undefined}
        aria-describedby={`${id}-hint`}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
      <span id={`${id}-hint`} class={error === undefined ? 'hint' : 'wrong'}>
        {error ?? hint}
      </span>
    </div>
  )
}
