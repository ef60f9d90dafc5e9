/** Scenarios of the job: presets and custom ones. */

import { useRef, useState } from 'preact/hooks'
import type { ScenarioPreset } from '../../api/types'
import { formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import type { FieldErrors } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { scenarioDraft } from '../draft/draft'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import type { SchemaField } from '../fields/schema-fields'
import type { SectionProps } from './section'

type CustomDraft = Readonly<Record<string, string>>

/** Fields in which the thesis's scenarios differ. */
const COMMON: ReadonlySet<string> = new Set(['cycle_time', 'load', 'slope', 'turn'])

export function ScenariosSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { presets, custom } = draft
  const hasPresets = draft.robot.kind !== 'files' || presets.length > 0
  const toggle = (name: string) => {
    const names = presets.includes(name) ? presets.filter((p) => p !== name) : [...presets, name]
    // In the catalogue's order.
    const order = catalogue.scenarios.map((s) => s.name).filter((n) => names.includes(n))
    onChange({ presets: order })
  }
  const replace = (index: number, scenario: CustomDraft | null) => {
    const rest = custom.map((old, k) => (k === index ? scenario : old))
    onChange({ custom: rest.filter((s) => s !== null) })
  }
  const add = (start: string) => {
    const preset = catalogue.scenarios.find(({ name }) => name === start) ?? null
    const name = `custom-${custom.length + 1}`
    onChange({ custom: [...custom, scenarioDraft(catalogue.fields.scenario, preset, name)] })
  }
  return (
    <section class="card" aria-labelledby="part-scenarios">
      <h2 id="part-scenarios">Scenarios</h2>
      <div class="stack">
        <Problems messages={errors.has('scenarios') ? [errors.get('scenarios')!] : []} />
        {hasPresets ? (
          <PresetTable catalogue={catalogue} chosen={presets} onToggle={toggle} />
        ) : (
          <p class="muted">
            The presets apply to Szabadka-II only. Add scenarios for this robot below, or load its
            job.json.
          </p>
        )}
        {custom.map((scenario, index) => (
          <CustomScenario
            // Scenarios have no other identity than their position.
            key={index}
            scenario={scenario}
            index={index}
            catalogue={catalogue}
            errors={errors}
            onChange={(changed) => replace(index, changed)}
          />
        ))}
        <div class="row">
          <label class="row">
            <span class="label">Add a custom scenario</span>
            <select
              value=""
              onChange={(event) => {
                add(event.currentTarget.value)
                event.currentTarget.value = ''
              }}
            >
              <option value="" disabled>
                starting from…
              </option>
              {catalogue.scenarios.map(({ name }) => (
                <option key={name} value={name}>
                  {name}
                </option>
              ))}
            </select>
          </label>
        </div>
      </div>
    </section>
  )
}

/** Presets with the fields in which they differ. */
function PresetTable({
  catalogue,
  chosen,
  onToggle,
}: {
  catalogue: Catalogue
  chosen: readonly string[]
  onToggle: (name: string) => void
}) {
  const differs = (field: SchemaField) =>
    new Set(catalogue.scenarios.map((scenario) => value(scenario, field))).size > 1
  const value = (scenario: ScenarioPreset, field: SchemaField) =>
    scenario[field.name as keyof ScenarioPreset]
  const fields = [...catalogue.fields.scenario.values()].filter(
    (field) => field.name !== 'name' && differs(field),
  )
  return (
    <div class="table-scroll">
      <table>
        <caption class="visually-hidden">Preset scenarios</caption>
        <thead>
          <tr>
            <th scope="col">Scenario</th>
            {fields.map((field) => (
              <th key={field.name} scope="col" class="numeric" title={field.description}>
                {inWords(field.name)}
                {field.unit !== '1' && <span class="unit"> [{field.unit}]</span>}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {catalogue.scenarios.map((scenario) => (
            <tr key={scenario.name}>
              <th scope="row">
                <label class="check nowrap">
                  <input
                    type="checkbox"
                    checked={chosen.includes(scenario.name)}
                    onChange={() => onToggle(scenario.name)}
                  />
                  {scenario.number} {scenario.name}
                </label>
              </th>
              {fields.map((field) => {
                const shown = value(scenario, field)
                return (
                  <td key={field.name} class="numeric">
                    {typeof shown === 'number' ? formatExact(shown) : inWords(String(shown ?? ''))}
                  </td>
                )
              })}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}

function CustomScenario({
  scenario,
  index,
  catalogue,
  errors,
  onChange,
}: {
  scenario: CustomDraft
  index: number
  catalogue: Catalogue
  errors: FieldErrors
  onChange: (scenario: CustomDraft | null) => void
}) {
  const at = `custom.${index}`
  const fields = [...catalogue.fields.scenario.values()].filter(({ name }) => name !== 'name')
  const change = (name: string) => (value: string) => onChange({ ...scenario, [name]: value })
  const error = (name: string) => errors.get(`${at}.${name}`)
  const defaults = scenarioDraft(catalogue.fields.scenario, null, '')
  // Empty fields have their defaults, too.
  const isSet = ({ name }: SchemaField) => !['', defaults[name]].includes(scenario[name] ?? '')
  // Determined once: fields must not move during typing.
  const [shown] = useState(() => new Set(fields.filter(isSet).map(({ name }) => name)))
  const isFirst = ({ name }: SchemaField) => COMMON.has(name) || shown.has(name)
  const further = fields.filter((field) => !isFirst(field))
  const allDefault = !further.some(isSet)
  // Stays open when a field in it is emptied.
  const opened = useRef(false)
  opened.current ||= !allDefault || further.some(({ name }) => error(name) !== undefined)
  const input = (field: SchemaField) =>
    field.choices ? (
      <ChoiceField
        key={field.name}
        label={inWords(field.name)}
        choices={field.choices}
        value={scenario[field.name]}
        error={error(field.name)}
        onChange={change(field.name)}
      />
    ) : (
      <NumberField
        key={field.name}
        label={inWords(field.name)}
        field={field}
        value={scenario[field.name] ?? ''}
        error={error(field.name)}
        onChange={change(field.name)}
      />
    )
  return (
    <fieldset class="custom-scenario" data-custom={index}>
      <legend>Custom scenario</legend>
      <Problems messages={errors.has(at) ? [errors.get(at)!] : []} />
      <div class="fields">
        <div class="field">
          <label for={`${at}-name`}>name</label>
          <input
            id={`${at}-name`}
            value={scenario.name}
            aria-invalid={error('name') !== undefined}
            onInput={(event) => change('name')(event.currentTarget.value)}
          />
          {error('name') !== undefined && <span class="wrong">{error('name')}</span>}
        </div>
        {fields.filter(isFirst).map(input)}
      </div>
      <details open={opened.current}>
        <summary>
          {further.length} more settings{allDefault && ', all at their defaults'}
        </summary>
        <div class="fields">{further.map(input)}</div>
      </details>
      <button type="button" class="compact" onClick={() => onChange(null)}>
        Remove {scenario.name}
      </button>
    </fieldset>
  )
}
