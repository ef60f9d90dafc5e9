/** What a succeeded job found, where its state alone would mislead: missed targets, failing worlds. */

import { get } from '../api/client'
import { cached, useResource } from '../api/resource'
import type { Certificate, StoredJob, Targets } from '../api/types'
import type { Outcome } from '../components/state'
import { formatCount, percent } from '../format/number'
import { placeWord } from '../format/place'

type LeaveOut = '' | 'target' | 'walk'

export function loadTargets({ id, best }: StoredJob, leaveOut: LeaveOut): Promise<Targets> {
  const query = leaveOut === '' ? {} : { leave_out: leaveOut }
  return cached(`targets ${id} ${best && placeWord(best)} ${leaveOut}`, () =>
    get('/v1/jobs/{job_id}/targets', { path: { job_id: id }, query }),
  )
}

export function loadCertificate({
  id,
  evaluations,
}: Pick<StoredJob, 'id' | 'evaluations'>): Promise<Certificate> {
  return cached(`certificate ${id} ${evaluations}`, () =>
    get('/v1/jobs/{job_id}/certificate', { path: { job_id: id }, query: { most: 20 } }),
  )
}

/** Null where the state says it all, and until the job has succeeded. */
export function useOutcome(job: StoredJob): Outcome | null {
  const { kind, evaluations, best } = job
  const found = useLoadedOutcome(job)
  const nothing = job.state === 'succeeded' && kind === 'tuning' && best === null
  return nothing && evaluations > 0 ? { text: 'no design found', tone: 'bad' } : found
}

function useLoadedOutcome(job: StoredJob): Outcome | null {
  const { id, kind, evaluations, best } = job
  const has = kind === 'calibration' ? best !== null : kind === 'certificate'
  return useResource(job.state === 'succeeded' && has ? `${id} ${evaluations}` : null, () =>
    kind === 'calibration'
      ? loadTargets(job, '').then(outcomeOfTargets)
      : loadCertificate(job).then(outcomeOfCertificate),
  ).data
}

/** Fitted targets within tolerance, and all of them. */
export function metTargets({ targets }: Targets): readonly [met: number, fitted: number] {
  const fitted = targets.filter(({ use }) => use === 'fit')
  return [fitted.filter(({ difference }) => isWithin(difference)).length, fitted.length]
}

/** difference: in tolerances. */
export function isWithin(difference: number | null): boolean {
  return difference !== null && Math.abs(difference) <= 1
}

function outcomeOfTargets(targets: Targets): Outcome {
  const [met, fitted] = metTargets(targets)
  const tone = met === fitted ? 'good' : met === 0 ? 'bad' : 'warn'
  return { text: `${formatCount(met)} of ${formatCount(fitted)} targets met`, tone }
}

/** Share of failing worlds from which a design counts as not robust [1]. */
const FRAGILE = 0.05

export function outcomeOfCertificate({ failed, worlds }: Certificate): Outcome {
  if (failed.count === 0)
    return { text: `no failure in ${formatCount(worlds)} worlds`, tone: 'good' }
  const text = `fails in ${percent(failed.share, 2)} of ${formatCount(worlds)} worlds`
  return { text, tone: failed.share < FRAGILE ? 'warn' : 'bad' }
}
