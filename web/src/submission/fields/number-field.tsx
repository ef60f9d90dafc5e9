/** Labelled form fields for numbers and choices, with bounds and errors. */

import { useId } from 'preact/hooks'
import { Unit } from '../../components/unit'
import { boundsInWords, describe, type SchemaField } from './schema-fields'
import './fields.css'

export function NumberField({
  label,
  field,
  value,
  error,
  help,
  changed = false,
  onChange,
}: {
  label: string
  field: SchemaField
  value: string
  error?: string
  /** Shown after the bounds; without it, the description becomes the input's title. */
  help?: string
  /** Whether the value differs from its default. */
  changed?: boolean
  onChange: (value: string) => void
}) {
  const id = useId()
  const bounds = boundsInWords(field)
  return (
    <div class="field" data-changed={changed}>
      <label for={id}>
        {label}
        <Unit unit={field.unit} />
      </label>
      <input
        id={id}
        inputMode="decimal"
        value={value}
        aria-invalid={error !== undefined}
        aria-describedby={`${id}-hint`}
        title={help === undefined ? describe(field) : undefined}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
      <span id={`${id}-hint`}>
        <span class="hint">{[bounds, help].filter((part) => part).join(' · ')}</span>
        {error !== undefined && <span class="wrong"> {error}</span>}
      </span>
    </div>
  )
}

/** A labelled choice; empty means the robot's value. */
export function ChoiceField({
  label,
  choices,
  value,
  error,
  hint,
  changed = false,
  onChange,
}: {
  label: string
  choices: readonly string[]
  value: string
  error?: string
  hint?: string
  /** Whether the value differs from its default. */
  changed?: boolean
  onChange: (value: string) => void
}) {
  const id = useId()
  return (
    <div class="field" data-changed={changed}>
      <label for={id}>{label}</label>
      <select
        id={id}
        value={value}
        aria-invalid={error !== undefined}
        onChange={(event) => onChange(event.currentTarget.value)}
      >
        {choices.map((choice) => (
          <option key={choice} value={choice}>
            {choice === '' ? 'robot’s default' : choice.replaceAll('_', ' ')}
          </option>
        ))}
      </select>
      {hint && <span class="hint">{hint}</span>}
      {error !== undefined && <span class="wrong">{error}</span>}
    </div>
  )
}

/** Errors that concern a part of the form rather than one field. */
export function Problems({ messages }: { messages: readonly string[] }) {
  if (messages.length === 0) return null
  return (
    <div class="wrong" role="alert">
      {messages.map((message) => (
        <p key={message}>{message}</p>
      ))}
    </div>
  )
}
