/** Scenarios of the job: presets and custom ones. */

import { useRef, useState } from 'preact/hooks'
import type { ScenarioPreset } from '../../api/types'
import { Card } from '../../components/card'
import { Check, Select } from '../../components/fields/controls'
import { Problems, TextField } from '../../components/fields/field'
import { type Column, Table } from '../../components/table/table'
import { formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import type { FieldErrors } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { scenarioDraft } from '../draft/draft'
import type { SchemaField } from '../fields/schema-fields'
import { SchemaInput } from '../fields/schema-input'
import type { SectionProps } from './settings'

type CustomDraft = Readonly<Record<string, string>>

/** Fields in which the thesis's scenarios differ. */
const COMMON: ReadonlySet<string> = new Set(['cycle_time', 'load', 'slope', 'turn'])

export function ScenariosSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { presets, custom } = draft
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
    onChange({ custom: [...custom, scenarioDraft(catalogue.fields.scenario, preset, name)] })
  }
  return (
    <Card title="Scenarios">
      <div class="stack">
        <Problems messages={[errors.get('scenarios')]} />
        {hasPresets ? (
          <Table
            caption="Preset scenarios"
            rows={catalogue.scenarios}
            rowKey={({ name }) => name}
            columns={presetColumns(catalogue, presets, toggle)}
          />
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
          <Select
            // Shows its first option again after each scenario added.
            key={custom.length}
            label="Add a custom scenario"
            value=""
            options={[['', 'starting from…', true], ...names.map((name) => [name, name] as const)]}
            onChoose={add}
          />
        </div>
      </div>
    </Card>
  )
}

/** Selection, and the fields in which the presets differ. */
function presetColumns(
  { scenarios, fields }: Catalogue,
  selected: readonly string[],
  onToggle: (name: string) => void,
): readonly Column<ScenarioPreset>[] {
  const value = (scenario: ScenarioPreset, { name }: SchemaField) =>
    scenario[name as keyof ScenarioPreset]
  const differing = [...fields.scenario.values()].filter(
    (field) =>
      field.name !== 'name' && new Set(scenarios.map((each) => value(each, field))).size > 1,
  )
  return [
    {
      key: 'scenario',
      header: true,
      cell: ({ name, number }) => (
        <span class="nowrap">
          <Check
            small={false}
            label={`${number} ${name}`}
            checked={selected.includes(name)}
            onChange={() => onToggle(name)}
          />
        </span>
      ),
    },
    ...differing.map(
      (field): Column<ScenarioPreset> => ({
        key: field.name,
        label: inWords(field.name),
        unit: field.unit,
        help: field.description,
        numeric: true,
        cell: (scenario) => {
          const shown = value(scenario, field)
          return typeof shown === 'number' ? formatExact(shown) : inWords(String(shown ?? ''))
        },
      }),
    ),
  ]
}

interface CustomScenarioProps {
  scenario: CustomDraft
  index: number
  catalogue: Catalogue
  errors: FieldErrors
  onChange: (scenario: CustomDraft | null) => void
}

function CustomScenario({ scenario, index, catalogue, errors, onChange }: CustomScenarioProps) {
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
    <fieldset class="custom-scenario" data-custom={index}>
      <legend>Custom scenario</legend>
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
    </fieldset>
  )
}
