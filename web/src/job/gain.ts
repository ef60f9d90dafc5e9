/** By which share a job's best is better than the published design, or than the start. */

import { get } from '../api/client'
import { useResource } from '../api/resource'
import type { ReferenceView, StoredJob } from '../api/types'
import type { ReferenceLine } from '../charts/lines/reference-line'

export interface Gain {
  /** Null while it is not known, and where there is none. */
  readonly reference: ReferenceLine | null
  /** [1]; null if it is not known. */
  readonly share: number | null
  /** Why it is not known, for people. */
  readonly reason: string | null
}

const UNKNOWN: Gain = { reference: null, share: null, reason: null }

/** What is stored with the job; else the server is asked, which lets the design walk once. */
export function useGain(job: StoredJob | null): Gain {
  const stored = job?.reference ?? null
  const asks = stored === null && job?.kind === 'tuning' && job.best_fitness !== null
  const asked = useResource(asks ? `reference ${job.id}` : null, (signal) =>
    get('/v1/jobs/{job_id}/reference', { path: { job_id: job!.id }, signal }),
  )
  const found = stored ?? asked.data?.reference ?? null
  return gainOf(found, job?.best_fitness ?? null, asked.data?.reason ?? null)
}

export function gainOf(
  reference: ReferenceView | null,
  best: number | null,
  reason: string | null,
): Gain {
  if (reference === null || reference.fitness === null) return { ...UNKNOWN, reason }
  const { fitness } = reference
  const share = best === null || !(fitness > 0) ? null : 1 - best / fitness
  return { reference: { label: referenceLabel(reference), fitness }, share, reason }
}

/** What a job's best is measured against, for people. */
export function referenceLabel({ name, kind }: Pick<ReferenceView, 'name' | 'kind'>): string {
  return kind === 'start' ? name : `published ${name}`
}
