/** Search method and its settings, as described by the API. */

import type { OptimizerPreset } from '../../api/types'
import { Segmented } from '../../components/fields/segmented'
import { capitalized, inWords, sentence } from '../../format/words'
import {
  methodNamed,
  methodsOf,
  type OptimizerDraft,
  presetsOf,
  settingsOf,
  settingText,
  withPreset,
} from '../draft/optimizer'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import { describe, type SchemaField } from '../fields/schema-fields'
import type { SectionProps } from './section'

export function OptimizerSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { optimizers } = catalogue
  const { optimizer } = draft
  const method = methodNamed(optimizers, optimizer.name)
  const presets = presetsOf(optimizers, optimizer.name)
  const settings = presets.map((preset) => [preset.name, withPreset(optimizer, preset)] as const)
  const fields = settingsOf(method)
  const choose = (name: string) => {
    const chosen = methodNamed(optimizers, name)
    if (chosen) onChange({ optimizer: withPreset(optimizer, chosen) })
  }
  const knownKeys = new Set(fields.map(({ name }) => `optimizer.${name}`))
  const others = [...errors]
    .filter(([key]) => key === 'optimizer' || (key.startsWith('optimizer.') && !knownKeys.has(key)))
    .map(([, message]) => message)
  return (
    <section class="card" aria-labelledby="part-optimizer">
      <h2 id="part-optimizer">Optimizer</h2>
      <div class="stack-tight">
        <ChoiceField
          label="Method"
          choices={methodsOf(optimizers).map(({ name }) => name)}
          value={optimizer.name}
          hint={method && hintOf(method)}
          onChange={choose}
        />
        {presets.length > 1 && (
          <Segmented
            roomy
            label="Preset of the optimizer"
            value={settings.flatMap(([name, each]) => (matches(each, optimizer) ? [name] : []))}
            options={presets.map(({ name }) => [name, name] as const)}
            onChoose={(chosen) => {
              onChange({ optimizer: settings.find(([name]) => name === chosen)![1] })
            }}
          />
        )}
        <Problems messages={others} />
      </div>
      <div class="fields">
        {fields.map((field) => (
          <SettingField
            key={`${optimizer.name} ${field.name}`}
            field={field}
            defaultValue={settingText(method?.settings[field.name as keyof typeof method.settings])}
            optimizer={optimizer}
            error={errors.get(`optimizer.${field.name}`)}
            onChange={(value) => onChange({ optimizer: { ...optimizer, [field.name]: value } })}
          />
        ))}
      </div>
    </section>
  )
}

function matches(settings: OptimizerDraft, optimizer: OptimizerDraft): boolean {
  return Object.keys(settings).every((key) => settings[key] === optimizer[key])
}

function hintOf({ description, needs }: OptimizerPreset): string {
  const text = sentence(description)
  return needs === null ? text : `${text} Not installed where the job would run: ${needs}.`
}

/** One setting; changed values show their default. */
function SettingField({
  field,
  defaultValue,
  optimizer,
  error,
  onChange,
}: {
  field: SchemaField
  defaultValue: string
  optimizer: OptimizerDraft
  error?: string
  onChange: (value: string) => void
}) {
  const value = optimizer[field.name] ?? ''
  const changed = value !== defaultValue
  const help = sentence(describe(field))
  const note = changed && defaultValue !== '' ? `${help} Default: ${defaultValue}.` : help
  const shared = { label: capitalized(inWords(field.name)), value, error, changed, onChange }
  const choices = field.type === 'boolean' ? ['true', 'false'] : field.choices
  return choices ? (
    <ChoiceField {...shared} choices={choices} hint={note} />
  ) : (
    <NumberField {...shared} field={field} help={note} />
  )
}
