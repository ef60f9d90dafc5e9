/** From the form's draft to a spec; and from the fields that the API blames to those of the form. */

import type { FieldError } from '../../api/problem'
import type { JobSpec, Scenario, Variable } from '../../api/types'
import type { Draft } from './draft'
import { optimizerSettings } from './optimizer'
import { startOf } from './start'

/** Problems by the form's fields: `iterations`, `own.0.radius`, `variables.FI1R.low`, ... */
export type FieldErrors = ReadonlyMap<string, string>

/**
 * The spec that the draft asks for. What is not a number is left as it was written, so that the API
 * says at which field a number is missing.
 */
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
  return {
    name: draft.name,
    robot: robotOf(draft),
    controller: draft.controller,
    scenarios: [...draft.presets, ...draft.own.map(scenarioOf)],
    variables,
    fixed: Object.fromEntries(fixed),
    preference: preferenceOf(draft),
    ...(draft.case !== null && { case: optimizerSettings(draft.case) }),
    ...(worlds !== undefined && { worlds }),
    optimizer: optimizerSettings(draft.optimizer),
    iterations: number(draft.iterations),
    seed: number(draft.seed),
    precision: draft.precision,
    ...(start !== undefined && { start }),
  } as unknown as JobSpec
}

/** Gives integer variables their kind, which bounds of one's own would otherwise lose. */
export function withKinds(spec: JobSpec, known: readonly Variable[]): JobSpec {
  const kinds = new Map(known.map(({ name, kind }) => [name, kind]))
  const variables = spec.variables?.map((entry) =>
    typeof entry === 'string' ? entry : { ...entry, kind: kinds.get(entry.name) ?? 'continuous' },
  )
  return { ...spec, variables }
}

/** Where in the form the API's problems belong; what belongs nowhere is under the empty name. */
export function errorsByField(errors: readonly FieldError[], draft: Draft): FieldErrors {
  const found = new Map<string, string>()
  const searched = Object.keys(draft.variables).filter(
    (name) => draft.variables[name].mode === 'searched',
  )
  for (const { field, message } of errors) {
    const key = formField(field, draft, searched)
    found.set(key, found.has(key) ? `${found.get(key)}; ${message}` : message)
  }
  return found
}

/** The problem of a field or of anything inside of it. */
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
    return index >= 0 ? ['own', index, ...rest].join('.') : 'scenarios'
  }
  if (first === 'variables' && second !== undefined) {
    return ['variables', searched[Number(second)] ?? second, ...rest].join('.')
  }
  if (first === 'fixed' && second !== undefined) return `variables.${second}.value`
  return field
}

/** The robot that a draft says, as jobs and walks name it. */
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
  if (preference.kind !== 'own') return preference.kind as JobSpec['preference']
  const { bias, exponent } = preference
  return {
    bias: bias.map(number),
    exponent: exponent.map(number),
  } as unknown as JobSpec['preference']
}

/** undefined for a job that is judged in the model alone. */
function worldsOf({ worlds }: Draft): JobSpec['worlds'] | undefined {
  if (!worlds.robust) return undefined
  const values = Object.entries(worlds.values).map(([name, value]) => [name, number(value)])
  const ranges = worlds.ranges && { ranges: worlds.ranges }
  return { ...Object.fromEntries(values), ...ranges } as JobSpec['worlds']
}

function scenarioOf(own: Readonly<Record<string, string>>): Scenario {
  const { name, ...rest } = own
  return { name, ...numbers(rest) } as unknown as Scenario
}

/** Numbers and objects where they are, text elsewhere; what was left empty is left out. */
function numbers(values: Readonly<Record<string, string>>): Record<string, unknown> {
  const given = Object.entries(values).filter(([, value]) => value.trim() !== '')
  return Object.fromEntries(given.map(([name, value]) => [name, object(value) ?? number(value)]))
}

/** The object that a text is in JSON, if it is one. */
function object(text: string): unknown {
  if (!text.trim().startsWith('{')) return null
  try {
    return JSON.parse(text)
  } catch {
    return null
  }
}

/** The text itself where it is no number. */
export function number(text: string): number | string {
  const value = Number(text)
  return text.trim() === '' || Number.isNaN(value) ? text : value
}
