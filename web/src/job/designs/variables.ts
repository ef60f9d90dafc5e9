/** Variables of a job's spec. */

import type { Job, Variable } from '../../api/types'

/** The searched variables, with bounds and units. */
export function searchedVariables(spec: Job['spec']): readonly Variable[] {
  // Presets are resolved in a stored spec.
  return (spec.variables ?? []).filter((v): v is Variable => typeof v !== 'string')
}
