/** Start designs of a job. */

import type { AnySpec } from '../api/types'
import type { Design } from '../format/value'

/** Start designs; references to jobs were resolved to designs when the job was stored. */
export function startDesigns({ spec }: { readonly spec: AnySpec }): readonly Design[] {
  return Array.isArray(spec.start) ? (spec.start as readonly Design[]) : []
}
