/** Conversion of the form's draft to a spec, and of API errors to form fields. */

import type { FieldError } from '../../api/problem'
import type { JobSpec, Variable } from '../../api/types'
import { measureOf } from '../sections/measure'
import type { Draft } from './draft'
import { constraintsOf, number, settingValues, startOf } from './settings'

/** Errors by form field: `iterations`, `custom.0.radius`, `variables.FI1R.low`, ... */
export type FieldErrors = ReadonlyMap<string, string>

/** Build a spec; invalid numbers are passed on as text, so that the API reports the field. */
export function specOf(draft: Draft): JobSpec {
  const variables = Object.entries(draft.variables)
    .filter(([, { mode }]) => mode === 'searched')
    .map(([name, { low, high, choices }]) =>
      choices.length > 0
        ? { name, kind: 'categorical', choices }
        : { name, low: number(low), high: number(high) },
    )
  const fixed = Object.entries(draft.variables)
    .filter(([, { mode }]) => mode === 'fixed')
    .map(([name, { value }]) => [name, number(value)])
  const start = startOf(draft.start)
  const worlds = worldsOf(draft)
  const constraints = constraintsOf(draft.constraints)
  return {
    name: draft.name,
    robot: robotOf(draft),
    controller: draft.controller,
    scenarios: [...draft.presets, ...draft.custom.map(settingValues)],
    variables,
    fixed: Object.fromEntries(fixed),
    preference: preferenceOf(draft),
    ...(constraints.length > 0 && { constraints }),
    ...measureOf(scenarioNames(draft), draft),
    ...(draft.case !== null && { case: settingValues(draft.case) }),
    ...(worlds !== undefined && { worlds }),
    optimizer: settingValues(draft.optimizer),
    iterations: number(draft.iterations),
    seed: number(draft.seed),
    precision: draft.precision,
    ...(start !== undefined && { start }),
  } as unknown as JobSpec
}

/** Set the kinds of the variables, which custom bounds would otherwise drop. */
export function withKinds(spec: JobSpec, available: readonly Variable[]): JobSpec {
  const kinds = new Map(available.map(({ name, kind }) => [name, kind]))
  const variables = spec.variables?.map((entry) =>
    typeof entry === 'string' ? entry : { ...entry, kind: kinds.get(entry.name) ?? 'continuous' },
  )
  return { ...spec, variables }
}

/** Assign API errors to form fields; the others have an empty key. */
export function errorsByField(errors: readonly FieldError[], draft: Draft): FieldErrors {
  const errorsByKey = new Map<string, string>()
  const searched = Object.keys(draft.variables).filter(
    (name) => draft.variables[name].mode === 'searched',
  )
  for (const { field, message } of errors) {
    const key = formField(field, draft, searched)
    errorsByKey.set(key, errorsByKey.has(key) ? `${errorsByKey.get(key)}; ${message}` : message)
  }
  return errorsByKey
}

/** Errors of a field and of the fields inside it. */
export function errorsUnder(errors: FieldErrors, field: string): readonly string[] {
  return [...errors]
    .filter(([key]) => key === field || key.startsWith(`${field}.`))
    .map(([key, message]) =>
      key === field ? message : `${key.slice(field.length + 1)}: ${message}`,
    )
}

function formField(field: string, draft: Draft, searched: readonly string[]): string {
  const [first, second, ...rest] = field.split('.')
  if (first === 'scenarios' && second !== undefined) {
    const index = Number(second) - draft.presets.length
    return index >= 0 ? ['custom', index, ...rest].join('.') : 'scenarios'
  }
  if (first === 'variables' && second !== undefined) {
    return ['variables', searched[Number(second)] ?? second, ...rest].join('.')
  }
  if (first === 'fixed' && second !== undefined) return `variables.${second}.value`
  return field
}

export function robotOf({ robot }: Pick<Draft, 'robot'>): JobSpec['robot'] {
  if (robot.kind === 'shipped') return robot.name as JobSpec['robot']
  if (robot.kind === 'files') return { toml: robot.toml, urdf: robot.urdf }
  return {
    name: robot.name,
    contact_law: robot.contact_law || null,
    planned_soles: robot.planned_soles || null,
    backlash: robot.backlash.map(number),
  } as unknown as JobSpec['robot']
}

function preferenceOf({ preference }: Draft): JobSpec['preference'] {
  if (preference.kind !== 'custom') return preference.kind as JobSpec['preference']
  const [bias, exponent] = [preference.bias.map(number), preference.exponent.map(number)]
  return { bias, exponent } as unknown as JobSpec['preference']
}

/** Names of the scenarios, in the order of the spec. */
export function scenarioNames({ presets, custom }: Draft): readonly string[] {
  return [...presets, ...custom.map(({ name }) => name)]
}

/** undefined for a job evaluated in the nominal model only. */
function worldsOf({ worlds }: Draft): JobSpec['worlds'] | undefined {
  if (!worlds.robust) return undefined
  const values = Object.entries(worlds.values).map(([name, value]) => [name, number(value)])
  const ranges = worlds.ranges && { ranges: worlds.ranges }
  return { ...Object.fromEntries(values), ...ranges } as JobSpec['worlds']
}
