/** A number field that commits its text on Enter or blur. */

import { useState } from 'preact/hooks'

/** onChange: receives the text typed; empty if it is not a number. */
export function NumberField({
  label,
  value,
  min,
  step = 'any',
  narrow = false,
  onChange,
}: {
  label: string
  value: number
  min?: number
  step?: number | 'any'
  narrow?: boolean
  onChange: (text: string) => void
}) {
  // Local, so that updates of a running job do not overwrite the text being typed.
  const [written, setWritten] = useState<string | null>(null)
  return (
    <input
      class={narrow ? 'short' : undefined}
      type="number"
      min={min}
      step={step}
      value={written ?? value}
      aria-label={label}
      onInput={(event) => setWritten(event.currentTarget.value)}
      onChange={(event) => {
        setWritten(null)
        onChange(event.currentTarget.value)
      }}
      onBlur={() => setWritten(null)}
    />
  )
}
