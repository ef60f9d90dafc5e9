/** Inputs for the fields of a schema. */

import { ChoiceField, TextField } from '../../components/fields/field'
import { Unit } from '../../components/text'
import { capitalized, inWords } from '../../format/words'
import { errorsUnder, type FieldErrors } from '../draft/build-spec'
import { boundsInWords, describe, type SchemaField } from './schema-fields'

export function SchemaInput({
  field,
  label = capitalized(inWords(field.name)),
  help,
  value,
  ...shared
}: {
  field: SchemaField
  label?: string
  /** Shown after the bounds; without it, the description becomes the input's title. */
  help?: string
  value: string | undefined
  error?: string
  changed?: boolean
  onChange: (value: string) => void
}) {
  const choices = field.type === 'boolean' ? ['true', 'false'] : field.choices
  if (choices) {
    return (
      <ChoiceField {...shared} label={label} choices={choices} value={value ?? ''} hint={help} />
    )
  }
  return (
    <TextField
      {...shared}
      label={
        <>
          {label}
          <Unit unit={field.unit} />
        </>
      }
      inputMode="decimal"
      value={value ?? ''}
      hint={[boundsInWords(field), help].filter(Boolean).join(' · ')}
      title={help === undefined ? describe(field) : undefined}
    />
  )
}

/** Errors of a part of the spec that concern none of the fields shown. */
export function otherErrors(
  errors: FieldErrors,
  part: string,
  fields: readonly SchemaField[],
): readonly string[] {
  return errorsUnder(errors, part).filter(
    (message) => !fields.some(({ name }) => message.startsWith(`${name}: `)),
  )
}
