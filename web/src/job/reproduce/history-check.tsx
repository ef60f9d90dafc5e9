/** The head of a job's history, and on request whether all that it stands for is as it was. */

import { useState } from 'preact/hooks'
import { post } from '../../api/client'
import type { HistoryVerification, Job } from '../../api/types'
import { CopyButton } from '../../components/copy-button'
import { ErrorNotice } from '../../components/feedback'

export function HistoryCheck({ job }: { job: Job }) {
  const [found, setFound] = useState<HistoryVerification | null>(null)
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  if (!job.head) {
    return <p class="muted small">History: not chained, as no digest of it was stored.</p>
  }
  const verify = () => {
    setBusy(true)
    setError(null)
    post('/v1/jobs/{job_id}/verify', { path: { job_id: job.id }, body: { replay: 0 } })
      .then(setFound, setError)
      .finally(() => setBusy(false))
  }
  return (
    <div class="stack-tight" data-head={job.head}>
      <div class="row">
        <span class="muted small">
          History: head <code title={job.head}>{job.head.slice(0, 16)}…</code>
        </span>
        <CopyButton text={job.head} label="the head" />
        <button type="button" class="compact" disabled={busy} onClick={verify}>
          Verify
        </button>
      </div>
      {/* Always there, so that what appears in it is read out. */}
      <p class="small" role="status" data-verified={found ? String(found.verified) : undefined}>
        {found && sentence(found)}
      </p>
      {error !== null && <ErrorNotice what="The history cannot be verified." error={error} />}
    </div>
  )
}

function sentence({ verified, checks }: HistoryVerification): string {
  const said = checks.map(({ detail }) => detail).join('; ')
  return verified ? `History verified: ${said}.` : `The history was changed: ${said}.`
}
