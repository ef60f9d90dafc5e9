/** Parts of the form's draft that hold settings as text: optimizer, case, worlds and start. */

import type { JobSpec, OptimizerPreset, PluginCase, TuningWorlds } from '../../api/types'
import type { Design } from '../../format/value'
import { fieldsIn, type ObjectSchema, type SchemaField } from '../fields/schema-fields'

export type OptimizerDraft = Readonly<Record<string, string>>

/** The catalogue entry of a method with default settings, which is named like the method. */
export function methodNamed(
  optimizers: readonly OptimizerPreset[],
  name: string | undefined,
): OptimizerPreset | undefined {
  return optimizers.find((entry) => entry.name === name && entry.settings.name === name)
}

export function methodsOf(optimizers: readonly OptimizerPreset[]): readonly OptimizerPreset[] {
  return optimizers.filter(({ name, settings }) => name === settings.name)
}

/** All entries of a method: default settings first, then presets. */
export function presetsOf(
  optimizers: readonly OptimizerPreset[],
  method: string,
): readonly OptimizerPreset[] {
  return optimizers.filter(({ settings }) => settings.name === method)
}

/** Settings of a method or case in schema order, without its name. */
export function settingsOf(
  entry: { readonly settings_schema: object } | undefined,
): readonly SchemaField[] {
  const fields = entry ? fieldsIn(entry.settings_schema as ObjectSchema) : new Map()
  return [...fields.values()].filter(({ name }) => name !== 'name')
}

/** Apply a preset's settings; the number of designs per iteration is kept. */
export function withPreset(
  optimizer: OptimizerDraft,
  { settings }: OptimizerPreset,
): OptimizerDraft {
  return { ...settingTexts(settings), particles: optimizer.particles }
}

/** Draft of a spec's settings, completed with the method's defaults. */
export function optimizerDraft(
  optimizers: readonly OptimizerPreset[],
  requested: string | object | undefined,
  defaultMethod: string,
): OptimizerDraft {
  if (typeof requested === 'string') {
    const preset = optimizers.find(({ name }) => name === requested)
    return settingTexts(preset?.settings ?? { name: requested })
  }
  const overrides = settingTexts(requested ?? {})
  const method = methodNamed(optimizers, overrides.name ?? defaultMethod)
  return { ...settingTexts(method?.settings ?? {}), ...overrides }
}

/** Values for a spec; empty ones are omitted. */
export function settingValues(texts: OptimizerDraft): Record<string, unknown> {
  const overrides = Object.entries(texts).filter(([, text]) => text.trim() !== '')
  return Object.fromEntries(overrides.map(([name, text]) => [name, settingValue(text)]))
}

export function settingTexts(settings: object): OptimizerDraft {
  return Object.fromEntries(Object.entries(settings).map(([name, v]) => [name, settingText(v)]))
}

export function settingText(value: unknown): string {
  if (value === undefined || value === null) return ''
  return typeof value === 'object' ? JSON.stringify(value) : String(value)
}

/** A number, or the text itself if it is not one. */
export function number(text: string): number | string {
  const value = Number(text)
  return text.trim() === '' || Number.isNaN(value) ? text : value
}

/** Parse a number, boolean, list or object; keep other text. */
function settingValue(text: string): unknown {
  if (text === 'true' || text === 'false') return text === 'true'
  try {
    return /^\s*[[{]/.test(text) ? JSON.parse(text) : number(text)
  } catch {
    return text
  }
}

/** null for gaitswarm's simulator. */
export type CaseDraft = OptimizerDraft | null

/** A case with its default settings, overridden by a spec's. */
export function caseDraft(entry: PluginCase | undefined, overrides: object = {}): CaseDraft {
  if (!entry) return null
  const defaults = settingsOf(entry).map((field) => [field.name, settingText(field.default)])
  return { ...Object.fromEntries(defaults), ...settingTexts(overrides), name: entry.name }
}

/** Draft of a spec's case, given by name or settings; null also if the case is unknown. */
export function caseOf(requested: unknown, cases: readonly PluginCase[]): CaseDraft {
  if (typeof requested === 'string') return caseDraft(cases.find(({ name }) => name === requested))
  if (typeof requested !== 'object' || requested === null || !('name' in requested)) return null
  return caseDraft(
    cases.find(({ name }) => name === requested.name),
    requested,
  )
}

export interface WorldsDraft {
  /** Whether designs are evaluated in many worlds, not just the nominal model. */
  readonly robust: boolean
  readonly values: Readonly<Record<string, string>>
  /** Perturbations of a cloned job with their bounds; null for all with default bounds. */
  readonly ranges: TuningWorlds['ranges'] | null
}

const OF_A_LEVEL: readonly string[] = ['quantile', 'cvar']

/** Fields that the form can set, in schema order: numbers and choices. */
export function worldsFields(fields: ReadonlyMap<string, SchemaField>): readonly SchemaField[] {
  return [...fields.values()].filter(({ type }) => type !== 'other')
}

export function hasEffect({ name }: SchemaField, { values }: WorldsDraft): boolean {
  return name !== 'level' || OF_A_LEVEL.includes(values.aggregate)
}

export function worldsDraft(
  fields: ReadonlyMap<string, SchemaField>,
  worlds: JobSpec['worlds'] = null,
): WorldsDraft {
  const overrides = new Map<string, unknown>(Object.entries(worlds ?? {}))
  const values = worldsFields(fields).map(({ name, default: defaultValue }) => [
    name,
    String(overrides.get(name) ?? defaultValue ?? ''),
  ])
  return {
    robust: worlds !== null,
    values: Object.fromEntries(values),
    ranges: worlds?.ranges ?? null,
  }
}

/** Simulations of a design per scenario; NaN for an invalid number. */
export function walksEach({ robust, values }: WorldsDraft): number {
  return robust ? Number.parseInt(values.count, 10) : 1
}

/** Constraints as text, one per line; those relative to a design are JSON. */
export function constraintsText(constraints: JobSpec['constraints']): string {
  const lines = (constraints ?? []).flatMap((entry) => {
    if (typeof entry === 'string') return [entry]
    const { scenario = '*', quantity, min, max, relative_to: reference } = entry
    if (reference && typeof reference === 'object') {
      return [JSON.stringify({ ...entry, reference: undefined })]
    }
    const where = scenario === '*' ? '' : `${scenario}:`
    const job = reference && !reference.startsWith('published:') ? 'job:' : ''
    const multiple = reference ? `*${job}${reference}` : ''
    return [
      ['>=', min],
      ['<=', max],
    ].flatMap(([sign, limit]) =>
      limit == null ? [] : [`${where}${quantity}${sign}${limit}${multiple}`],
    )
  })
  return lines.join('\n')
}

/** Inverse of `constraintsText`; lines that are not JSON are passed on, so that the API reports them. */
export function constraintsOf(text: string): NonNullable<JobSpec['constraints']> {
  return linesOf(text).map((line) => {
    try {
      return line.startsWith('{') ? JSON.parse(line) : line
    } catch {
      return line
    }
  })
}

/** Limit of a quantity in every scenario, among constraints as text; empty if there is none. */
export function limitOf(constraints: string, quantity: string, sign: string): string {
  const line = linesOf(constraints).find((each) => each.startsWith(quantity + sign))
  return line?.slice(quantity.length + sign.length) ?? ''
}

/** Replace the limit of a quantity; an empty one removes it. */
export function withLimit(
  constraints: string,
  quantity: string,
  sign: string,
  limit: string,
): string {
  const others = linesOf(constraints).filter((each) => !each.startsWith(quantity + sign))
  return [...others, ...(limit.trim() === '' ? [] : [quantity + sign + limit.trim()])].join('\n')
}

function linesOf(text: string): readonly string[] {
  return text
    .split('\n')
    .map((line) => line.trim())
    .filter(Boolean)
}

export interface StartDraft {
  readonly jobs: readonly string[]
  readonly count: string
  /** Start designs of a cloned job; used if `jobs` is empty. */
  readonly designs: readonly Design[]
}

export const NO_START: StartDraft = { jobs: [], count: '5', designs: [] }

/** Draft of a spec's start, in which jobs were resolved to designs. */
export function startDraft(start: JobSpec['start']): StartDraft {
  if (start === undefined) return NO_START
  if (Array.isArray(start)) return { ...NO_START, designs: start as readonly Design[] }
  const { jobs, count } = start as { jobs: readonly string[]; count?: number }
  return { ...NO_START, jobs, count: String(count ?? NO_START.count) }
}

export function startOf({ jobs, count, designs }: StartDraft): JobSpec['start'] | undefined {
  if (jobs.length > 0) return { jobs, count: number(count) } as JobSpec['start']
  return designs.length > 0 ? (designs as JobSpec['start']) : undefined
}
