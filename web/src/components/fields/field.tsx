/** Labelled form fields with a hint, or an error in its place. */

import type { ComponentChildren, InputHTMLAttributes } from 'preact'
import { useId } from 'preact/hooks'
import './fields.css'

export interface FieldProps {
  readonly label: ComponentChildren
  readonly hint?: ComponentChildren
  readonly error?: string
  readonly changed?: boolean
  readonly wide?: boolean
}

interface Connection {
  readonly id: string
  readonly 'aria-invalid': boolean
  readonly 'aria-describedby': string | undefined
}

export function Field({
  label,
  hint,
  error,
  changed,
  wide = false,
  children,
}: FieldProps & { children: (connection: Connection) => ComponentChildren }) {
  const id = useId()
  const note = hint || error !== undefined ? `${id}-hint` : undefined
  return (
    <div class={wide ? 'field wide' : 'field'} data-changed={changed}>
      <label for={id}>{label}</label>
      {children({ id, 'aria-invalid': error !== undefined, 'aria-describedby': note })}
      {note && (
        <span id={note} class={error === undefined ? 'hint' : 'wrong'}>
          {error ?? hint}
        </span>
      )}
    </div>
  )
}

interface InputProps {
  readonly type?: 'text' | 'number'
  readonly inputMode?: 'decimal' | 'numeric'
  readonly min?: number
  readonly max?: number
  readonly step?: number
  readonly maxLength?: number
  readonly placeholder?: string
  readonly spellcheck?: boolean
  readonly title?: string
  readonly class?: string
}

/** A text, on several lines with `rows`; further attributes are those of the input. */
export function TextField({
  label,
  hint,
  error,
  changed,
  wide,
  rows,
  onChange,
  value,
  ...input
}: FieldProps & InputProps & { value: string; rows?: number; onChange: (value: string) => void }) {
  return (
    <Field label={label} hint={hint} error={error} changed={changed} wide={wide}>
      {(connection) =>
        rows === undefined ? (
          <input
            {...connection}
            {...(input as InputHTMLAttributes<HTMLInputElement>)}
            value={value}
            onInput={(event) => onChange(event.currentTarget.value)}
          />
        ) : (
          <textarea
            {...connection}
            rows={rows}
            class={input.class}
            maxLength={input.maxLength}
            spellcheck={input.spellcheck}
            value={value}
            onInput={(event) => onChange(event.currentTarget.value)}
          />
        )
      }
    </Field>
  )
}

/** A choice; an empty one means the robot's value. */
export function ChoiceField({
  choices,
  value,
  onChange,
  ...field
}: FieldProps & {
  choices: readonly string[]
  value: string
  onChange: (value: string) => void
}) {
  return (
    <Field {...field}>
      {(connection) => (
        <select
          {...connection}
          value={value}
          onChange={(event) => onChange(event.currentTarget.value)}
        >
          {choices.map((choice) => (
            <option key={choice} value={choice}>
              {choice === '' ? 'robot’s default' : choice.replaceAll('_', ' ')}
            </option>
          ))}
        </select>
      )}
    </Field>
  )
}

/** A file; choosing the same one again reads it again. */
export function FileField({
  accept,
  onFile,
  ...field
}: FieldProps & { accept: string; onFile: (file: File) => void }) {
  return (
    <Field {...field}>
      {(connection) => (
        <input
          {...connection}
          type="file"
          accept={accept}
          onClick={(event) => {
            event.currentTarget.value = ''
          }}
          onChange={(event) => {
            const file = event.currentTarget.files?.[0]
            if (file) onFile(file)
          }}
        />
      )}
    </Field>
  )
}

/** Errors that concern a part of a form rather than one field. */
export function Problems({ messages }: { messages: readonly (string | undefined)[] }) {
  const present = messages.filter((message) => message !== undefined)
  if (present.length === 0) return null
  return (
    <div class="wrong" role="alert">
      {present.map((message) => (
        <p key={message}>{message}</p>
      ))}
    </div>
  )
}
