/** The variables of a job, as its spec writes them out. */

import type { Job, Variable } from '../../api/types'

/** What the optimizer searches, with bounds and units. */
export function searchedVariables(spec: Job['spec']): readonly Variable[] {
  // A stored spec names no presets, every variable is written out.
  return (spec.variables ?? []).filter((v): v is Variable => typeof v !== 'string')
}

/** Unit of each searched variable, by name; those held fixed are not in the spec with a unit. */
export function variableUnits(spec: Job['spec']): ReadonlyMap<string, string> {
  return new Map(searchedVariables(spec).map((v) => [v.name, v.unit ?? '1']))
}
