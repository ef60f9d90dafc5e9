/** Where a job's search began. Pure. */

import type { AnySpec } from '../api/types'
import type { Design } from '../format/value'

/** The designs that a job judged first; jobs that it named have become designs when it was stored. */
export function startDesigns({ spec }: { readonly spec: AnySpec }): readonly Design[] {
  return Array.isArray(spec.start) ? (spec.start as readonly Design[]) : []
}
