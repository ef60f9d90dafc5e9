/** Scenarios of the job: presets and custom ones. */

import { useRef, useState } from 'preact/hooks'
import type { ScenarioPreset } from '../../api/types'
import { Card } from '../../components/card'
import { Check, Select } from '../../components/fields/controls'
import { Problems, TextField } from '../../components/fields/field'
import { exactQuantity } from '../../format/number'
import { inWords } from '../../format/words'
import { type FieldErrors, scenarioNames } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { scenarioDraft } from '../draft/draft'
import type { SchemaField } from '../fields/schema-fields'
import { SchemaInput } from '../fields/schema-input'
import { MeasureFields } from './measure'
import type { SectionProps } from './settings'

type CustomDraft = Readonly<Record<string, string>>

/** Fields in which the thesis's scenarios differ. */
const COMMON: ReadonlySet<string> = new Set(['cycle_time', 'load', 'slope', 'turn'])

/** Fields in which presets differ for the sake of the gait. */
const GAIT: ReadonlySet<string> = new Set(['name', 'radius', 'hip_height'])

/** Scenarios of a job by default. */
const USUAL = 6

export function ScenariosSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { presets, custom } = draft
  const [added, setAdded] = useState(false)
  const hasPresets = draft.robot.kind !== 'files' || presets.length > 0
  const names = catalogue.scenarios.map(({ name }) => name)
  // In the catalogue's order.
  const toggle = (name: string) =>
    onChange({ presets: names.filter((each) => presets.includes(each) !== (each === name)) })
  const replace = (index: number, scenario: CustomDraft | null) => {
    const rest = custom.map((old, k) => (k === index ? scenario : old))
    onChange({ custom: rest.filter((s) => s !== null) })
  }
  const add = (start: string) => {
    const preset = catalogue.scenarios.find(({ name }) => name === start) ?? null
    const name = `custom-${custom.length + 1}`
    setAdded(true)
    onChange({ custom: [...custom, scenarioDraft(catalogue.fields.scenario, preset, name)] })
  }
  const choice = { catalogue, selected: presets, onToggle: toggle }
  return (
    <Card title="Scenarios">
      <div class="stack">
        <Problems messages={[errors.get('scenarios')]} />
        {hasPresets ? (
          <>
            <PresetChoices {...choice} scenarios={catalogue.scenarios.slice(0, USUAL)} />
            <details open={presets.some((name) => names.indexOf(name) >= USUAL)}>
              <summary>{names.length - USUAL} more scenarios</summary>
              <PresetChoices {...choice} scenarios={catalogue.scenarios.slice(USUAL)} />
            </details>
          </>
        ) : (
          custom.length === 0 && (
            <p class="muted">
              The presets apply to Szabadka-II only. A robot brings its scenarios; others can be
              added here.
            </p>
          )
        )}
        {custom.map((scenario, index) => (
          <CustomScenario
            // Scenarios have no other identity than their position.
            key={index}
            scenario={scenario}
            index={index}
            catalogue={catalogue}
            errors={errors}
            added={added && index === custom.length - 1}
            onChange={(changed) => replace(index, changed)}
          />
        ))}
        <div class="row">
          <Select
            // Shows its first option again after each scenario added.
            key={custom.length}
            label="Add a custom scenario"
            value=""
            options={[['', 'starting from…', true], ...names.map((name) => [name, name] as const)]}
            onChoose={add}
          />
        </div>
        <MeasureFields
          names={scenarioNames(draft)}
          {...draft}
          errors={errors}
          onChange={onChange}
        />
      </div>
    </Card>
  )
}

interface PresetChoicesProps {
  scenarios: readonly ScenarioPreset[]
  catalogue: Catalogue
  selected: readonly string[]
  onToggle: (name: string) => void
}

/** Presets, with the values in which they differ from the first. */
function PresetChoices({ scenarios, catalogue, selected, onToggle }: PresetChoicesProps) {
  const [first] = catalogue.scenarios
  const words = (scenario: ScenarioPreset) =>
    [...catalogue.fields.scenario.values()]
      .flatMap(({ name, unit }) => {
        const value = scenario[name as keyof ScenarioPreset]
        const usual = first[name as keyof ScenarioPreset]
        if (GAIT.has(name) || JSON.stringify(value) === JSON.stringify(usual)) return []
        return [`${inWords(name)} ${shown(value, unit)}`]
      })
      .join(', ')
  return (
    <ul class="presets">
      {scenarios.map((scenario) => (
        <li key={scenario.name}>
          <Check
            small={false}
            label={`${scenario.number} ${scenario.name}`}
            checked={selected.includes(scenario.name)}
            onChange={() => onToggle(scenario.name)}
          />
          <span class="muted small">{words(scenario)}</span>
        </li>
      ))}
    </ul>
  )
}

function shown(value: unknown, unit: string): string {
  if (typeof value === 'number') return exactQuantity(value, unit)
  const word = typeof value === 'object' ? (value as { kind?: string } | null)?.kind : value
  return inWords(`${word ?? 'none'}`)
}

interface CustomScenarioProps {
  scenario: CustomDraft
  index: number
  catalogue: Catalogue
  errors: FieldErrors
  /** Whether it was just added. */
  added: boolean
  onChange: (scenario: CustomDraft | null) => void
}

function CustomScenario({
  scenario,
  index,
  catalogue,
  errors,
  added,
  onChange,
}: CustomScenarioProps) {
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
  const input = (field: SchemaField) => (
    <SchemaInput
      key={field.name}
      field={field}
      label={inWords(field.name)}
      value={scenario[field.name]}
      error={error(field.name)}
      onChange={change(field.name)}
    />
  )
  return (
    <details
      class="custom-scenario"
      data-custom={index}
      open={added || errors.has(at) || [...errors.keys()].some((key) => key.startsWith(`${at}.`))}
    >
      <summary>
        <b>{scenario.name}</b>{' '}
        <span class="muted">
          {fields
            .filter((field) => COMMON.has(field.name) && isSet(field))
            .map(
              ({ name, unit }) =>
                `${inWords(name)} ${scenario[name]}${unit === '1' ? '' : ` ${unit}`}`,
            )
            .join(', ')}
        </span>
      </summary>
      <Problems messages={[errors.get(at)]} />
      <div class="fields">
        <TextField
          label="name"
          value={scenario.name}
          error={error('name')}
          onChange={change('name')}
        />
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
    </details>
  )
}
