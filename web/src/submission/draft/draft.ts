/** A job as it stands in the form: numbers are still text, choices not yet a spec. */

import type { JobSpec, Scenario, Variable } from '../../api/types'
import type { SchemaField } from '../fields/schema-fields'
import { type CaseDraft, caseOf } from './case'
import { type Catalogue, ofLegGroups, variablesOf } from './catalogue'
import { type OptimizerDraft, optimizerDraft } from './optimizer'
import { NO_START, type StartDraft, startDraft } from './start'
import { type WorldsDraft, worldsDraft } from './worlds'

/** What becomes of a variable; `default` leaves a convention, or the gait to each scenario. */
export type VariableMode = 'searched' | 'fixed' | 'default'

export interface VariableDraft {
  readonly mode: VariableMode
  readonly low: string
  readonly high: string
  /** Of a categorical variable the name of a choice. */
  readonly value: string
  /** Of a categorical variable those that are searched, in place of bounds; else none. */
  readonly choices: readonly string[]
}

export interface RobotDraft {
  readonly kind: 'shipped' | 'variant' | 'files'
  /** Of a shipped robot, also of a variant's. */
  readonly name: string
  /** Empty where it is the robot's own, as planned_soles. */
  readonly contact_law: string
  readonly planned_soles: string
  /** Coxa, femur, tibia [deg]. */
  readonly backlash: readonly string[]
  readonly toml: string
  readonly urdf: string
}

export interface PreferenceDraft {
  /** Name of a preset, or `own`. */
  readonly kind: string
  readonly bias: readonly string[]
  readonly exponent: readonly string[]
}

export interface Draft {
  readonly name: string
  readonly robot: RobotDraft
  readonly controller: string
  /** Names of the presets that are chosen. */
  readonly presets: readonly string[]
  /** Scenarios of one's own, by field. */
  readonly own: readonly Readonly<Record<string, string>>[]
  readonly variables: Readonly<Record<string, VariableDraft>>
  readonly preference: PreferenceDraft
  readonly case: CaseDraft
  readonly worlds: WorldsDraft
  /** Settings of the method that is its `name`. */
  readonly optimizer: OptimizerDraft
  readonly start: StartDraft
  readonly iterations: string
  readonly seed: string
  readonly precision: string
}

/** What the API does if nothing is said. */
export function emptyDraft(catalogue: Catalogue): Draft {
  const { job, variant } = catalogue.fields
  const controller = String(job.get('controller')?.default)
  const preset = String(job.get('preference')?.default)
  return {
    name: '',
    robot: {
      kind: 'shipped',
      name: text(variant.get('name')?.default),
      contact_law: text(variant.get('contact_law')?.default),
      planned_soles: text(variant.get('planned_soles')?.default),
      backlash: list(variant.get('backlash')?.default, 3),
      toml: '',
      urdf: '',
    },
    controller,
    presets: names(job.get('scenarios')?.default),
    own: [],
    variables: defaultVariables(catalogue, controller),
    preference: preferenceDraft(catalogue, preset),
    case: null,
    worlds: worldsDraft(catalogue.fields.worlds),
    optimizer: optimizerDraft(catalogue.optimizers, undefined, usualMethod(catalogue)),
    start: NO_START,
    iterations: text(job.get('iterations')?.default),
    seed: text(job.get('seed')?.default),
    precision: text(job.get('precision')?.default),
  }
}

/** All variables of a controller searched within the catalogue's bounds, all others left alone. */
export function defaultVariables(
  catalogue: Catalogue,
  controller: string,
): Readonly<Record<string, VariableDraft>> {
  const found = catalogue.controllers.find(({ name }) => name === controller)
  if (!found) return {}
  const published = found.published.A ?? Object.values(found.published)[0] ?? {}
  const entry = (variable: Variable, mode: VariableMode): [string, VariableDraft] => [
    variable.name,
    variableDraft(variable, mode, published[variable.name]),
  ]
  return Object.fromEntries([
    ...found.variables.map((variable) => entry(variable, 'searched')),
    ...[...found.conventions, ...found.gait_variables].map((v) => entry(v, 'default')),
  ])
}

/** A variable within the catalogue's bounds. value: that it has where it is fixed, if one is known. */
export function variableDraft(
  variable: Variable,
  mode: VariableMode,
  value?: number | string,
): VariableDraft {
  return {
    mode,
    low: text(variable.low),
    high: text(variable.high),
    value: shown(variable, value ?? variable.default ?? undefined) ?? text(middle(variable)),
    choices: variable.choices ?? [],
  }
}

/** The form of a spec that was submitted before; presets are recognized by their values. */
export function draftOf(spec: JobSpec, catalogue: Catalogue): Draft {
  const empty = emptyDraft(catalogue)
  const controller = spec.controller ?? empty.controller
  const scenarios = (spec.scenarios ?? []).map((entry) =>
    typeof entry === 'string' ? entry : (presetOf(entry, catalogue) ?? entry),
  )
  return {
    name: spec.name ?? '',
    robot: robotDraft(spec.robot, empty.robot),
    controller,
    presets: scenarios.filter((entry) => typeof entry === 'string'),
    own: scenarios.filter((entry) => typeof entry !== 'string').map(texts),
    variables: variableDrafts(spec, catalogue, controller),
    preference: preferenceOf(spec.preference, catalogue) ?? empty.preference,
    case: caseOf(spec.case, catalogue.cases),
    worlds: worldsDraft(catalogue.fields.worlds, spec.worlds),
    optimizer: optimizerDraft(catalogue.optimizers, spec.optimizer, usualMethod(catalogue)),
    start: startDraft(spec.start),
    iterations: text(spec.iterations),
    seed: text(spec.seed),
    precision: spec.precision ?? empty.precision,
  }
}

/** The draft with those of its scenarios that are named. */
export function withScenarios(draft: Draft, wanted: readonly string[]): Draft {
  return {
    ...draft,
    presets: draft.presets.filter((name) => wanted.includes(name)),
    own: draft.own.filter(({ name }) => wanted.includes(name)),
  }
}

/** A scenario of one's own to start from: a preset's values, or those that have a default. */
export function scenarioDraft(
  fields: ReadonlyMap<string, SchemaField>,
  start: Scenario | null,
  name: string,
): Readonly<Record<string, string>> {
  const values = start === null ? {} : texts(start)
  const known = Object.entries({ ...defaults(fields), ...values }).filter(([key]) =>
    fields.has(key),
  )
  return { ...Object.fromEntries(known), name }
}

export function preferenceDraft(catalogue: Catalogue, kind: string): PreferenceDraft {
  const preset = catalogue.preferences.find(({ name }) => name === kind) ?? catalogue.preferences[0]
  return { kind, bias: preset.bias.map(text), exponent: preset.exponent.map(text) }
}

/** The draft of a preference; one of the presets if it has a preset's values. */
export function preferenceOf(
  preference: JobSpec['preference'] | undefined,
  catalogue: Catalogue,
): PreferenceDraft | null {
  if (preference === undefined) return null
  if (typeof preference === 'string') return preferenceDraft(catalogue, preference)
  const preset = catalogue.preferences.find(
    ({ bias, exponent }) =>
      JSON.stringify([bias, exponent]) === JSON.stringify([preference.bias, preference.exponent]),
  )
  if (preset) return preferenceDraft(catalogue, preset.name)
  return { kind: 'own', bias: preference.bias.map(text), exponent: preference.exponent.map(text) }
}

/** The method of a job that names none. */
function usualMethod({ fields, optimizers }: Catalogue): string {
  const usual = fields.job.get('optimizer')?.default as { name?: string } | undefined
  return usual?.name ?? optimizers[0].settings.name
}

function variableDrafts(
  spec: JobSpec,
  catalogue: Catalogue,
  controller: string,
): Readonly<Record<string, VariableDraft>> {
  const drafts = { ...defaultVariables(catalogue, controller) }
  const known = catalogue.controllers.find(({ name }) => name === controller)
  const own = variablesOf(known)
  const named = (spec.variables ?? []).map((entry) =>
    typeof entry === 'string' ? entry : entry.name,
  )
  const groups = ofLegGroups(own, [...named, ...Object.keys(spec.fixed ?? {})])
  for (const variable of groups) drafts[variable.name] = variableDraft(variable, 'default')
  const variables = new Map([...own, ...groups].map((v) => [v.name, v]))
  if (spec.variables) {
    for (const entry of spec.variables) {
      const name = typeof entry === 'string' ? entry : entry.name
      const bounds =
        typeof entry === 'string'
          ? {}
          : { low: text(entry.low), high: text(entry.high), choices: entry.choices ?? [] }
      if (drafts[name]) drafts[name] = { ...drafts[name], ...bounds, mode: 'searched' }
    }
  }
  for (const [name, value] of Object.entries(spec.fixed ?? {})) {
    const variable = variables.get(name)
    if (!variable) continue
    drafts[name] = { ...drafts[name], value: shown(variable, value) ?? '', mode: 'fixed' }
  }
  return drafts
}

function robotDraft(robot: JobSpec['robot'], empty: RobotDraft): RobotDraft {
  if (robot === undefined) return empty
  if (typeof robot === 'string') return { ...empty, name: robot }
  if ('toml' in robot) return { ...empty, kind: 'files', toml: robot.toml, urdf: robot.urdf }
  return {
    ...empty,
    kind: 'variant',
    name: robot.name ?? empty.name,
    contact_law: robot.contact_law ?? empty.contact_law,
    planned_soles: robot.planned_soles ?? empty.planned_soles,
    backlash: robot.backlash?.map(text) ?? empty.backlash,
  }
}

/** Name of the preset with the same values in every field. */
function presetOf(scenario: Scenario, catalogue: Catalogue): string | null {
  const fields = [...catalogue.fields.scenario.keys()] as (keyof Scenario)[]
  const same = catalogue.scenarios.find((preset) =>
    fields.every((field) => text(preset[field]) === text(scenario[field])),
  )
  return same?.name ?? null
}

function defaults(fields: ReadonlyMap<string, SchemaField>): Record<string, string> {
  return Object.fromEntries([...fields].map(([name, field]) => [name, text(field.default)]))
}

/** Of its bounds, or the first of its choices. */
export function middle({ low, high, kind, choices }: Variable): number | string {
  if (kind === 'categorical') return choices?.[0] ?? ''
  const value = Number(((low + high) / 2).toPrecision(4))
  return kind === 'integer' ? Math.round(value) : value
}

/** A value as people read it: the name of a choice, where it is given by its index. */
function shown({ choices }: Variable, value: number | string | undefined): string | null {
  if (value === undefined) return null
  return choices?.[Number(value)] ?? text(value)
}

function texts(values: object): Record<string, string> {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, text(value)]))
}

function list(values: unknown, length: number): readonly string[] {
  return Array.isArray(values) ? values.map(text) : Array(length).fill('0')
}

function names(values: unknown): readonly string[] {
  return Array.isArray(values) ? values.map(text) : []
}

function text(value: unknown): string {
  if (value === undefined || value === null) return ''
  return typeof value === 'object' ? JSON.stringify(value) : String(value)
}
