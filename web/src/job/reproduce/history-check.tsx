/** Digest of a job's history, and its verification on request. */

import { useState } from 'preact/hooks'
import { post } from '../../api/client'
import type { HistoryVerification, Job } from '../../api/types'
import { CopyButton } from '../../components/copy-button'
import { ErrorNotice } from '../../components/feedback'

export function HistoryCheck({ job }: { job: Job }) {
  const [verification, setVerification] = useState<HistoryVerification | null>(null)
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  if (!job.head) {
    return <p class="muted small">History: not chained, since no digest was stored.</p>
  }
  const verify = () => {
    setBusy(true)
    setError(null)
    post('/v1/jobs/{job_id}/verify', { path: { job_id: job.id }, body: { replay: 0 } })
      .then(setVerification, setError)
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
      {/* Always present, so that screen readers announce its content. */}
      <p
        class="small"
        role="status"
        data-verified={verification ? String(verification.verified) : undefined}
      >
        {verification && sentence(verification)}
      </p>
      {error !== null && <ErrorNotice what="Could not verify the history." error={error} />}
    </div>
  )
}

function sentence({ verified, checks }: HistoryVerification): string {
  const details = checks.map(({ detail }) => detail).join('; ')
  return verified ? `History verified: ${details}.` : `The history was modified: ${details}.`
}
