/** Form draft of the worlds of a robust job. */

import type { JobSpec, TuningWorlds } from '../../api/types'
import type { SchemaField } from '../fields/schema-fields'

export interface WorldsDraft {
  /** Whether designs are evaluated in many worlds, not just the nominal model. */
  readonly robust: boolean
  readonly values: Readonly<Record<string, string>>
  /** Perturbations of a cloned job with their bounds; null for all with default bounds. */
  readonly ranges: TuningWorlds['ranges'] | null
}

/** Aggregates with a level. */
const OF_A_LEVEL: readonly string[] = ['quantile', 'cvar']

/** Fields that the form can set, in schema order: numbers and choices. */
export function worldsFields(fields: ReadonlyMap<string, SchemaField>): readonly SchemaField[] {
  return [...fields.values()].filter(({ type }) => type !== 'other')
}

/** Whether a field has an effect, given the others. */
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
