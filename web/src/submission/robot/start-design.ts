/** Preview design: the middle of the search space. */

import type { JobSpec, Variable } from '../../api/types'
import type { Design } from '../../format/value'
import { middle } from '../draft/draft'

/** Fixed values stay; categorical variables take their first choice. variables: all of the controller. */
export function startDesign(spec: JobSpec, variables: readonly Variable[]): Design {
  const kinds = new Map(variables.map((variable) => [variable.name, variable]))
  const searched = (spec.variables ?? []).map((entry) => {
    const variable =
      typeof entry === 'string' ? kinds.get(entry) : { ...kinds.get(entry.name), ...entry }
    const name = typeof entry === 'string' ? entry : entry.name
    return [name, variable ? middle(variable as Variable) : Number.NaN] as const
  })
  return { ...Object.fromEntries(searched), ...spec.fixed } as Design
}
