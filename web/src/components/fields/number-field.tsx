/** A field for a number that counts once it is left or Enter is pressed. */

import { useState } from 'preact/hooks'

/**
 * What is being written outlasts the news that a running job brings: each draws the page again.
 *
 * onChange: gets the text as it was written; empty where it is no number.
 */
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
