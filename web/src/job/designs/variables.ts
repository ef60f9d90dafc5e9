/** The variables of a job, as its spec writes them out. */

import type { Job, Variable } from '../../api/types'

/** What the optimizer searches, with bounds and units. */
export function searchedVariables(spec: Job['spec']): readonly Variable[] {
  // A stored spec names no presets, every variable is written out.
  return (spec.variables ?? []).filter((v): v is Variable => typeof v !== 'string')
}
