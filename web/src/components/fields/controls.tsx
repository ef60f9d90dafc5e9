/** Fields that consist of a label and one control. */

import type { ComponentChildren } from 'preact'

/** A checkbox; among the tools of a chart by default. */
export function Check({
  label,
  checked,
  disabled = false,
  small = true,
  onChange,
}: {
  label: ComponentChildren
  checked: boolean
  disabled?: boolean
  small?: boolean
  onChange: (checked: boolean) => void
}) {
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
