/** Sections of the form whose fields come from schemas: job, case, worlds and optimizer. */

import { Card } from '../../components/card'
import { Segmented } from '../../components/fields/controls'
import { ChoiceField, Problems, TextField } from '../../components/fields/field'
import { formatCount } from '../../format/number'
import { sentence } from '../../format/words'
import { errorsUnder, type FieldErrors } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import type { Draft } from '../draft/draft'
import {
  caseDraft,
  hasEffect,
  methodNamed,
  methodsOf,
  presetsOf,
  settingsOf,
  settingText,
  type WorldsDraft,
  walksEach,
  withPreset,
  worldsFields,
} from '../draft/settings'
import { describe } from '../fields/schema-fields'
import { otherErrors, SchemaInput } from '../fields/schema-input'

export interface SectionProps {
  readonly draft: Draft
  readonly catalogue: Catalogue
  readonly errors: FieldErrors
  readonly onChange: (changes: Partial<Draft>) => void
}

export function JobSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { job } = catalogue.fields
  return (
    <Card title="Budget and constraints">
      <div class="fields">
        {(['iterations', 'seed'] as const).map((name) => (
          <SchemaInput
            key={name}
            field={job.get(name)!}
            value={draft[name]}
            error={errors.get(name)}
            onChange={(value) => onChange({ [name]: value })}
          />
        ))}
        <ChoiceField
          label="Precision"
          choices={job.get('precision')!.choices!}
          value={draft.precision}
          error={errors.get('precision')}
          hint="of the search; the best design is evaluated in double precision"
          onChange={(precision) => onChange({ precision })}
        />
        <TextField
          wide
          rows={2}
          label="Constraints"
          spellcheck={false}
          hint="optional, one per line: speed>=0.05, slope-fast:speed>=0.03, or *<=published:A"
          value={draft.constraints}
          error={errorsUnder(errors, 'constraints').join('; ') || undefined}
          onChange={(constraints) => onChange({ constraints })}
        />
      </div>
    </Card>
  )
}

const BUILT_IN = 'gaitswarm'

function missing(needs: string | null): string {
  return needs ? ` Not installed where the job would run: ${needs}.` : ''
}

/** Evaluation of designs: gaitswarm's simulator, or a plug-in case with its settings. */
export function CaseSection({ draft, catalogue: { cases }, errors, onChange }: SectionProps) {
  if (cases.length === 0) return null
  const selected = cases.find(({ name }) => name === draft.case?.name)
  const fields = settingsOf(selected)
  return (
    <Card title="Case">
      <ChoiceField
        label="Evaluated by"
        choices={[BUILT_IN, ...cases.map(({ name }) => name)]}
        value={draft.case?.name ?? BUILT_IN}
        hint={
          selected
            ? sentence(selected.description) + missing(selected.needs)
            : 'gaitswarm’s simulator.'
        }
        onChange={(name) =>
          onChange({ case: caseDraft(cases.find((entry) => entry.name === name)) })
        }
      />
      <Problems messages={otherErrors(errors, 'case', fields)} />
      <div class="fields">
        {fields.map((field) => (
          <SchemaInput
            key={field.name}
            field={field}
            help={describe(field)}
            value={draft.case?.[field.name]}
            error={errors.get(`case.${field.name}`)}
            onChange={(value) => onChange({ case: { ...draft.case, [field.name]: value } })}
          />
        ))}
      </div>
    </Card>
  )
}

export function WorldsSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { worlds } = draft
  const { robust, ranges } = worlds
  const change = (changes: Partial<WorldsDraft>) => onChange({ worlds: { ...worlds, ...changes } })
  const shown = worldsFields(catalogue.fields.worlds).filter((field) => hasEffect(field, worlds))
  const scenarios = draft.presets.length + draft.custom.length
  const each = walksEach(worlds)
  return (
    <Card title="Robustness">
      <div class="stack">
        <Segmented
          roomy
          label="Evaluated in"
          value={robust ? 'many' : 'one'}
          options={[
            ['one', 'nominal model'],
            ['many', 'many worlds'],
          ]}
          onChoose={(kind) => change({ robust: kind === 'many' })}
        />
        <p class="muted small">
          A robust job simulates every design in worlds with perturbed friction, masses, battery,
          gears, sensors and ground, and aggregates the results.
        </p>
        {robust && (
          <div class="fields">
            {shown.map((field) => (
              <SchemaInput
                key={field.name}
                field={field}
                label={field.name === 'count' ? 'Worlds' : undefined}
                help={sentence(describe(field))}
                value={worlds.values[field.name]}
                error={errors.get(`worlds.${field.name}`)}
                onChange={(value) => change({ values: { ...worlds.values, [field.name]: value } })}
              />
            ))}
          </div>
        )}
        {robust && ranges && (
          <p class="row">
            <span>
              {formatCount(ranges.length)} perturbations with the ranges of the cloned job.
            </span>
            <button type="button" class="compact" onClick={() => change({ ranges: null })}>
              Use all perturbations with default ranges
            </button>
          </p>
        )}
        {robust && each > 0 && (
          <p class="small" data-walks-each={each * scenarios}>
            Every design is simulated {formatCount(each * scenarios)} times: in{' '}
            {formatCount(scenarios)} scenario{scenarios === 1 ? '' : 's'}, each in{' '}
            {formatCount(each)} world{each === 1 ? '' : 's'}.
          </p>
        )}
        <Problems messages={otherErrors(errors, 'worlds', robust ? shown : [])} />
      </div>
    </Card>
  )
}

export function OptimizerSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { optimizers } = catalogue
  const { optimizer } = draft
  const method = methodNamed(optimizers, optimizer.name)
  const presets = presetsOf(optimizers, optimizer.name).map(
    (preset) => [preset.name, withPreset(optimizer, preset)] as const,
  )
  const fields = settingsOf(method)
  const defaults = new Map<string, unknown>(Object.entries(method?.settings ?? {}))
  return (
    <Card title="Optimizer">
      <div class="stack-tight">
        <ChoiceField
          label="Method"
          choices={methodsOf(optimizers).map(({ name }) => name)}
          value={optimizer.name}
          hint={method && sentence(method.description) + missing(method.needs)}
          onChange={(name) =>
            onChange({ optimizer: withPreset(optimizer, methodNamed(optimizers, name)!) })
          }
        />
        {presets.length > 1 && (
          <Segmented
            roomy
            label="Preset of the optimizer"
            value={presets.flatMap(([name, settings]) =>
              Object.keys(settings).every((key) => settings[key] === optimizer[key]) ? [name] : [],
            )}
            options={presets.map(([name]) => [name, name] as const)}
            onChoose={(preset) =>
              onChange({ optimizer: presets.find(([name]) => name === preset)![1] })
            }
          />
        )}
        <Problems messages={otherErrors(errors, 'optimizer', fields)} />
      </div>
      <div class="fields">
        {fields.map((field) => {
          const value = optimizer[field.name] ?? ''
          const usual = settingText(defaults.get(field.name))
          const changed = value !== usual
          const help = sentence(describe(field))
          return (
            <SchemaInput
              key={`${optimizer.name} ${field.name}`}
              field={field}
              help={changed && usual !== '' ? `${help} Default: ${usual}.` : help}
              value={value}
              error={errors.get(`optimizer.${field.name}`)}
              changed={changed}
              onChange={(next) => onChange({ optimizer: { ...optimizer, [field.name]: next } })}
            />
          )
        })}
      </div>
    </Card>
  )
}
