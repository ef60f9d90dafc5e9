/** Relative improvement of a job's best over the published or the start design. */

import { get } from '../api/client'
import { useResource } from '../api/resource'
import type { ReferenceView, StoredJob } from '../api/types'
import type { ReferenceLine } from '../charts/lines/reference-line'

export interface Gain {
  /** Null if unknown or if there is none. */
  readonly reference: ReferenceLine | null
  /** [1]; null if unknown. */
  readonly share: number | null
  readonly reason: string | null
}

/** Use the reference stored with the job; otherwise request it, which simulates one design. */
export function useGain(job: StoredJob | null): Gain {
  const stored = job?.reference ?? null
  const pending = stored === null && job?.kind === 'tuning' && job.best_fitness !== null
  const response = useResource(pending ? `reference ${job.id}` : null, (signal) =>
    get('/v1/jobs/{job_id}/reference', { path: { job_id: job!.id }, signal }),
  )
  const reference = stored ?? response.data?.reference ?? null
  return gainOf(reference, job?.best_fitness ?? null, response.data?.reason ?? null)
}

export function gainOf(
  reference: ReferenceView | null,
  best: number | null,
  reason: string | null,
): Gain {
  if (reference?.fitness == null) return { reference: null, share: null, reason }
  const { fitness } = reference
  const share = best === null || !(fitness > 0) ? null : 1 - best / fitness
  return { reference: { label: referenceLabel(reference), fitness }, share, reason }
}

export function referenceLabel({ name, kind }: Pick<ReferenceView, 'name' | 'kind'>): string {
  return kind === 'start' ? name : `published ${name}`
}
