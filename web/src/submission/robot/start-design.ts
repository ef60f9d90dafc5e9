/** A design to look at before there is a job: the middle of all that a job searches. */

import type { JobSpec, Variable } from '../../api/types'
import type { Design } from '../../format/value'
import { middle } from '../draft/draft'

/** What is fixed stays; of a choice the first. known: by name, for whole numbers. */
export function startDesign(spec: JobSpec, known: readonly Variable[]): Design {
  const kinds = new Map(known.map((variable) => [variable.name, variable]))
  const searched = (spec.variables ?? []).map((entry) => {
    const variable =
      typeof entry === 'string' ? kinds.get(entry) : { ...kinds.get(entry.name), ...entry }
    const name = typeof entry === 'string' ? entry : entry.name
    return [name, variable ? middle(variable as Variable) : Number.NaN] as const
  })
  return { ...Object.fromEntries(searched), ...spec.fixed } as Design
}
