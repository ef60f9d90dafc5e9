/** Analysis of a job: importance of its variables, and active bounds. */

import { useRef } from 'preact/hooks'
import { get } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Importance, Job } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { BoundsCard } from './bounds-card'
import { ImportanceCard } from './importance-card'

/** Polling interval of a running job [ms]. */
const RENEW_MS = 8000

export function AnalysisPanel({ job }: { job: Job }) {
  const iterations = useSlowly(job.iterations, RENEW_MS)
  if (job.iterations === 0) {
    return (
      <section class="card">
        <Empty title="Nothing to analyse yet">
          <p>Variable importance appears here after the first iteration.</p>
        </Empty>
      </section>
    )
  }
  return <Analysis job={job} iterations={iterations} />
}

function Analysis({ job, iterations }: { job: Job; iterations: number }) {
  const importance = useResource(`${job.id} ${iterations}`, (signal) =>
    get('/v1/jobs/{job_id}/importance', { path: { job_id: job.id }, signal }),
  )
  // Keep the previous result while the next one loads.
  const shown = useRef<Importance | null>(null)
  if (importance.data) shown.current = importance.data
  return (
    <div class="stack">
      {importance.error && (
        <ErrorNotice
          what="Could not load the variable importance."
          error={importance.error}
          retry={importance.reload}
        />
      )}
      {!shown.current && importance.loading && <Loading what="variable importance" />}
      {shown.current && (
        <>
          <ImportanceCard importance={shown.current} />
          <BoundsCard job={job} importance={shown.current} />
        </>
      )}
    </div>
  )
}
