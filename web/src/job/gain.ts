/** Improvement of a job's best over the published or the start design, and the verdict on it. */

import { get } from '../api/client'
import { useResource } from '../api/resource'
import type { ReferenceView, StoredJob, Verdict } from '../api/types'
import type { ReferenceLine } from '../charts/lines/reference-line'

/** Time without a better design before a running job is judged [ms]. */
const PAUSE = 1000

export interface Gain {
  /** Null if unknown or if there is none. */
  readonly reference: ReferenceLine | null
  /** [1]; null if unknown. */
  readonly share: number | null
  readonly reason: string | null
}

/** Request the verdict, which simulates the reference if it is not stored with the job. */
export function useGain(job: StoredJob | null): Gain & { readonly verdict: Verdict | null } {
  const value = job?.kind === 'tuning' ? (job.best_fitness ?? job.closest?.violation) : null
  const { data } = useResource(
    value == null ? null : `verdict ${job!.id} ${value} ${job!.finished_at}`,
    (signal) => get('/v1/jobs/{job_id}/verdict', { path: { job_id: job!.id }, signal }),
    { keep: true, pause: job?.finished_at ? 0 : PAUSE },
  )
  const reference = job?.reference ?? data?.reference ?? null
  return {
    ...gainOf(reference, job?.best_fitness ?? null, data?.reason ?? null),
    verdict: data,
  }
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
