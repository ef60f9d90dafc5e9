/** What decides what designs are worth: which variables matter, and which bounds hold the winner. */

import { useRef } from 'preact/hooks'
import { get } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Importance, Job } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { BoundsCard } from './bounds-card'
import { ImportanceCard } from './importance-card'

/** How often a running job is asked again [ms]. */
const RENEW_MS = 8000

export function AnalysisPanel({ job }: { job: Job }) {
  const iterations = useSlowly(job.iterations, RENEW_MS)
  if (job.iterations === 0) {
    return (
      <section class="card">
        <Empty title="Nothing to analyse yet">
          <p>Which variables matter is told here from the first committed iteration on.</p>
        </Empty>
      </section>
    )
  }
  return <Analysis job={job} iterations={iterations} />
}

function Analysis({ job, iterations }: { job: Job; iterations: number }) {
  const found = useResource(`${job.id} ${iterations}`, (signal) =>
    get('/v1/jobs/{job_id}/importance', { path: { job_id: job.id }, signal }),
  )
  // While a newer one is on its way, the one before stays to be looked at.
  const shown = useRef<Importance | null>(null)
  if (found.data) shown.current = found.data
  return (
    <div class="stack">
      {found.error && (
        <ErrorNotice
          what="Which variables matter cannot be told."
          error={found.error}
          retry={found.reload}
        />
      )}
      {!shown.current && found.loading && <Loading what="which variables matter" />}
      {shown.current && (
        <>
          <ImportanceCard found={shown.current} />
          <BoundsCard job={job} found={shown.current} />
        </>
      )}
    </div>
  )
}
