/** Button that submits a search for preferences around a tuning job. */

import { useState } from 'preact/hooks'
import { post } from '../../api/client'
import type { Job, JobSpec, PreferencesSpec } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { navigate } from '../../router/navigation'
import { jobPath } from '../../router/routes'

export function SearchButton({ job }: { job: Job }) {
  const [error, setError] = useState<unknown>(null)
  const [sending, setSending] = useState(false)
  const submit = () => {
    setSending(true)
    post('/v1/jobs', { body: searchAround(job) })
      .then(({ id }) => navigate(jobPath(id)), setError)
      .finally(() => setSending(false))
  }
  return (
    <>
      <button type="button" class="compact" disabled={sending} onClick={submit}>
        Search for preferences
      </button>
      {error !== null && <ErrorNotice what="Could not submit the search." error={error} />}
    </>
  )
}

/** The job's own search is replaced by the default one for optima, which begins with its best designs. */
function searchAround({ id, name, spec }: Job) {
  const { optimizer, iterations, name: _, ...tuning } = spec as JobSpec
  return {
    kind: 'preferences',
    name: `preferences of ${name || id}`.slice(0, 200),
    tuning: { ...tuning, start: { jobs: [id] } },
  } as unknown as PreferencesSpec
}
