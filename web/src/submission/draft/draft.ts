/** State of the new-job form: numbers as text, choices not yet resolved. */

import type { JobSpec, Scenario, Variable } from '../../api/types'
import type { SchemaField } from '../fields/schema-fields'
import { type Catalogue, ofLegGroups, variablesOf } from './catalogue'
import {
  type CaseDraft,
  caseOf,
  constraintsText,
  NO_START,
  type OptimizerDraft,
  optimizerDraft,
  type StartDraft,
  settingText,
  settingTexts,
  startDraft,
  type WorldsDraft,
  worldsDraft,
} from './settings'

/** `default` keeps a convention's default, or the scenarios' gait. */
export type VariableMode = 'searched' | 'fixed' | 'default'

export interface VariableDraft {
  readonly mode: VariableMode
  readonly low: string
  readonly high: string
  /** Name of a choice for a categorical variable. */
  readonly value: string
  /** Searched choices of a categorical variable; empty for others. */
  readonly choices: readonly string[]
}

export interface RobotDraft {
  readonly kind: 'shipped' | 'variant' | 'files'
  /** Name of a shipped robot, or of the one a variant is based on. */
  readonly name: string
  /** Empty for the robot's default, as planned_soles. */
  readonly contact_law: string
  readonly planned_soles: string
  readonly backlash: readonly string[]
  readonly toml: string
  readonly urdf: string
}

export interface PreferenceDraft {
  readonly kind: string
  readonly bias: readonly string[]
  readonly exponent: readonly string[]
}

export interface Draft {
  readonly name: string
  readonly robot: RobotDraft
  readonly controller: string
  readonly presets: readonly string[]
  readonly custom: readonly Readonly<Record<string, string>>[]
  readonly variables: Readonly<Record<string, VariableDraft>>
  readonly preference: PreferenceDraft
  /** One per line. */
  readonly constraints: string
  /** Of scenarios by name; 1 for all others. */
  readonly weights: Readonly<Record<string, string>>
  /** Of the utilities of all scenarios. */
  readonly aggregate: string
  readonly case: CaseDraft
  readonly worlds: WorldsDraft
  readonly optimizer: OptimizerDraft
  readonly start: StartDraft
  readonly iterations: string
  readonly seed: string
  readonly precision: string
}

export function emptyDraft(catalogue: Catalogue): Draft {
  const { job, variant } = catalogue.fields
  const usual = (name: string) => settingText(job.get(name)?.default)
  const controller = usual('controller')
  return {
    name: '',
    robot: {
      kind: 'shipped',
      name: settingText(variant.get('name')?.default),
      contact_law: settingText(variant.get('contact_law')?.default),
      planned_soles: settingText(variant.get('planned_soles')?.default),
      backlash: list(variant.get('backlash')?.default, ['0', '0', '0']),
      toml: '',
      urdf: '',
    },
    controller,
    presets: list(job.get('scenarios')?.default),
    custom: [],
    preference: preferenceDraft(catalogue, usual('preference')),
    ...defaultSearch(catalogue, controller, 'shipped'),
    weights: {},
    aggregate: usual('scenario_aggregate'),
    case: null,
    worlds: worldsDraft(catalogue.fields.worlds),
    optimizer: optimizerDraft(catalogue.optimizers, undefined, defaultMethod(catalogue)),
    start: NO_START,
    iterations: usual('iterations'),
    seed: usual('seed'),
    precision: usual('precision'),
  }
}

/** Gait variables of the thesis's chapter 3, without the cycle time, in which scenarios differ. */
const GAIT: ReadonlySet<string> = new Set(['stride', 'height', 'duty_factor', 'fir_ms'])

type Search = Pick<Draft, 'variables' | 'constraints'>

/**
 * Search controller and gait, no worse than a published design, from which the search starts: bounds
 * include the scenarios' own gait. Without a published design, search the controller alone.
 */
function defaultSearch(
  catalogue: Catalogue,
  controller: string,
  robot: RobotDraft['kind'],
): Search {
  const variables = defaultVariables(catalogue, controller)
  const names = Object.keys(
    catalogue.controllers.find(({ name }) => name === controller)?.published ?? {},
  )
  if (names.length === 0 || robot === 'files') return { variables, constraints: '' }
  const searched = Object.entries(variables).map(([name, draft]): [string, VariableDraft] => {
    if (!GAIT.has(name)) return [name, draft]
    const own = Number(catalogue.fields.scenario.get(name)?.default ?? draft.low)
    const low = String(Math.min(own, Number(draft.low)))
    return [
      name,
      { ...draft, low, high: String(Math.max(own, Number(draft.high))), mode: 'searched' },
    ]
  })
  const published = names.includes('A') ? 'A' : names[0]
  return { variables: Object.fromEntries(searched), constraints: `*<=published:${published}` }
}

/** Search another controller or kind of robot by default; other constraints stay. */
export function withSearch(
  draft: Draft,
  catalogue: Catalogue,
  { controller = draft.controller, robot = draft.robot }: Partial<Draft>,
): Search & Pick<Draft, 'controller' | 'robot'> {
  const before = defaultSearch(catalogue, draft.controller, draft.robot.kind)
  const { variables, constraints } = defaultSearch(catalogue, controller, robot.kind)
  const edited = draft.constraints !== before.constraints
  return { controller, robot, variables, constraints: edited ? draft.constraints : constraints }
}

/** Search all variables of a controller within the catalogue's bounds; keep the others at their defaults. */
export function defaultVariables(
  catalogue: Catalogue,
  controller: string,
): Readonly<Record<string, VariableDraft>> {
  const match = catalogue.controllers.find(({ name }) => name === controller)
  if (!match) return {}
  const published = match.published.A ?? Object.values(match.published)[0] ?? {}
  const entry = (variable: Variable, mode: VariableMode): [string, VariableDraft] => [
    variable.name,
    variableDraft(variable, mode, published[variable.name]),
  ]
  return Object.fromEntries([
    ...match.variables.map((variable) => entry(variable, 'searched')),
    ...[...match.conventions, ...match.gait_variables].map((v) => entry(v, 'default')),
  ])
}

/** A variable with the catalogue's bounds. value: initial value if it is fixed. */
export function variableDraft(
  variable: Variable,
  mode: VariableMode,
  value?: number | string,
): VariableDraft {
  return {
    mode,
    low: settingText(variable.low),
    high: settingText(variable.high),
    value:
      textOf(variable, value ?? variable.default ?? undefined) ?? settingText(middle(variable)),
    choices: variable.choices ?? [],
  }
}

/** Draft of an existing spec; presets are recognized by their values. */
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
    custom: scenarios.filter((entry) => typeof entry !== 'string').map(settingTexts),
    variables: variableDrafts(spec, catalogue, controller),
    preference: preferenceOf(spec.preference, catalogue) ?? empty.preference,
    constraints: constraintsText(spec.constraints),
    weights: settingTexts(spec.scenario_weights ?? {}),
    aggregate: spec.scenario_aggregate ?? empty.aggregate,
    case: caseOf(spec.case, catalogue.cases),
    worlds: worldsDraft(catalogue.fields.worlds, spec.worlds),
    optimizer: optimizerDraft(catalogue.optimizers, spec.optimizer, defaultMethod(catalogue)),
    start: startDraft(spec.start),
    iterations: settingText(spec.iterations),
    seed: settingText(spec.seed),
    precision: spec.precision ?? empty.precision,
  }
}

export function scenarioDraft(
  fields: ReadonlyMap<string, SchemaField>,
  start: Scenario | null,
  name: string,
): Readonly<Record<string, string>> {
  const values = start === null ? {} : settingTexts(start)
  const texts = [...fields].map(([key, field]) => [key, values[key] ?? settingText(field.default)])
  return { ...Object.fromEntries(texts), name }
}

export function preferenceDraft(catalogue: Catalogue, kind: string): PreferenceDraft {
  const preset = catalogue.preferences.find(({ name }) => name === kind) ?? catalogue.preferences[0]
  return { kind, bias: preset.bias.map(settingText), exponent: preset.exponent.map(settingText) }
}

/** Draft of a preference; a preset if the values match. */
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
  const [bias, exponent] = [preference.bias, preference.exponent].map((part) =>
    part.map(settingText),
  )
  return { kind: 'custom', bias, exponent }
}

function defaultMethod({ fields, optimizers }: Catalogue): string {
  const optimizerDefault = fields.job.get('optimizer')?.default as { name?: string } | undefined
  return optimizerDefault?.name ?? optimizers[0].settings.name
}

function variableDrafts(
  spec: JobSpec,
  catalogue: Catalogue,
  controller: string,
): Readonly<Record<string, VariableDraft>> {
  const drafts = { ...defaultVariables(catalogue, controller) }
  const entry = catalogue.controllers.find(({ name }) => name === controller)
  const controllerVariables = variablesOf(entry)
  const named = (spec.variables ?? []).map((entry) =>
    typeof entry === 'string' ? entry : entry.name,
  )
  const groups = ofLegGroups(controllerVariables, [...named, ...Object.keys(spec.fixed ?? {})])
  for (const variable of groups) drafts[variable.name] = variableDraft(variable, 'default')
  const variables = new Map([...controllerVariables, ...groups].map((v) => [v.name, v]))
  for (const [k, name] of named.entries()) {
    const entry = spec.variables![k]
    const bounds =
      typeof entry === 'string'
        ? {}
        : {
            low: settingText(entry.low),
            high: settingText(entry.high),
            choices: entry.choices ?? [],
          }
    if (drafts[name]) drafts[name] = { ...drafts[name], ...bounds, mode: 'searched' }
  }
  for (const [name, value] of Object.entries(spec.fixed ?? {})) {
    const variable = variables.get(name)
    if (!variable) continue
    drafts[name] = { ...drafts[name], value: textOf(variable, value) ?? '', mode: 'fixed' }
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
    backlash: robot.backlash?.map(settingText) ?? empty.backlash,
  }
}

function presetOf(scenario: Scenario, catalogue: Catalogue): string | null {
  const fields = [...catalogue.fields.scenario.keys()] as (keyof Scenario)[]
  const same = catalogue.scenarios.find((preset) =>
    fields.every((field) => settingText(preset[field]) === settingText(scenario[field])),
  )
  return same?.name ?? null
}

export function middle({ low, high, kind, choices }: Variable): number | string {
  if (kind === 'categorical') return choices?.[0] ?? ''
  const value = Number(((low + high) / 2).toPrecision(4))
  return kind === 'integer' ? Math.round(value) : value
}

/** A value as text; the name of a choice if given by index. */
function textOf({ choices }: Variable, value: number | string | undefined): string | null {
  if (value === undefined) return null
  return choices?.[Number(value)] ?? settingText(value)
}

function list(values: unknown, empty: readonly string[] = []): readonly string[] {
  return Array.isArray(values) ? values.map(settingText) : empty
}
