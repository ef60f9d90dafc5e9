/** Worlds that a robust job is judged in, as the form has them. Pure. */

import type { JobSpec, TuningWorlds } from '../../api/types'
import type { SchemaField } from '../fields/schema-fields'

export interface WorldsDraft {
  /** Whether designs are judged in many worlds, or in the model alone. */
  readonly robust: boolean
  /** Texts of the fields that can be set, by name. */
  readonly values: Readonly<Record<string, string>>
  /** Perturbations of a cloned job, with its bounds; null draws all with their usual ones. */
  readonly ranges: TuningWorlds['ranges'] | null
}

/** Aggregates that ask for a level. */
const OF_A_LEVEL: readonly string[] = ['quantile', 'cvar']

/** What the form sets, in the order of the schema: numbers and choices, no lists. */
export function worldsFields(fields: ReadonlyMap<string, SchemaField>): readonly SchemaField[] {
  return [...fields.values()].filter(({ type }) => type !== 'other')
}

/** Whether a field makes a difference beside the others. */
export function counts({ name }: SchemaField, { values }: WorldsDraft): boolean {
  return name !== 'level' || OF_A_LEVEL.includes(values.aggregate)
}

/** The worlds of a spec that was submitted before; what it leaves out has the default. */
export function worldsDraft(
  fields: ReadonlyMap<string, SchemaField>,
  worlds: JobSpec['worlds'] = null,
): WorldsDraft {
  const given = new Map<string, unknown>(Object.entries(worlds ?? {}))
  const values = worldsFields(fields).map(({ name, default: usual }) => [
    name,
    String(given.get(name) ?? usual ?? ''),
  ])
  return {
    robust: worlds !== null,
    values: Object.fromEntries(values),
    ranges: worlds?.ranges ?? null,
  }
}

/** How often a design walks in each scenario; NaN if that is no number. */
export function walksEach({ robust, values }: WorldsDraft): number {
  return robust ? Number.parseInt(values.count, 10) : 1
}
