/** Single controls with their labels. */

import type { ComponentChildren } from 'preact'
import { useState } from 'preact/hooks'

interface CheckProps {
  label: ComponentChildren
  checked: boolean
  disabled?: boolean
  small?: boolean
  onChange: (checked: boolean) => void
}

/** A checkbox; among the tools of a chart by default. */
export function Check({ label, checked, disabled = false, small = true, onChange }: CheckProps) {
  return (
    <label class={small ? 'check small' : 'check'}>
      <input
        type="checkbox"
        checked={checked}
        disabled={disabled}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
      {label}
    </label>
  )
}

export type Option<K extends string = string> = readonly [value: K, text: string, off?: boolean]

/** A choice from a list. hidden: whether the label is for screen readers only. */
export function Select<K extends string>({
  label,
  value,
  options,
  hidden = false,
  onChoose,
}: {
  label: string
  value: K
  options: readonly Option<K>[]
  hidden?: boolean
  onChoose: (value: K) => void
}) {
  const select = (
    <select
      aria-label={hidden ? label : undefined}
      value={value}
      onChange={(event) => onChoose(event.currentTarget.value as K)}
    >
      {options.map(([key, text, off]) => (
        <option key={key} value={key} disabled={off}>
          {text}
        </option>
      ))}
    </select>
  )
  if (hidden) return select
  return (
    // biome-ignore lint/a11y/noLabelWithoutControl: the control is the select
    <label class="row small">
      <span>{label}</span>
      {select}
    </label>
  )
}

/** A choice among a few options, as adjacent buttons. */
export function Segmented<K extends string>({
  label,
  value,
  options,
  onChoose,
  roomy = false,
}: {
  label: string
  /** Several for equivalent options; empty if none applies. */
  value: K | readonly K[]
  options: readonly (readonly [key: K, text: string])[]
  onChoose: (key: K) => void
  /** As high as the fields of a form. */
  roomy?: boolean
}) {
  const pressed: readonly string[] = typeof value === 'string' ? [value] : value
  return (
    <fieldset class="segmented" aria-label={label}>
      {options.map(([key, text]) => (
        <button
          key={key}
          type="button"
          class={roomy ? undefined : 'compact'}
          aria-pressed={pressed.includes(key)}
          onClick={() => onChoose(key)}
        >
          {text}
        </button>
      ))}
    </fieldset>
  )
}

/** A number committed on Enter or blur. onChange: receives the text typed; empty if it is no number. */
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
