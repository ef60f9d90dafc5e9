/** Button that submits a search for preferences around a tuning job. */

import { post } from '../../api/client'
import { useCommand } from '../../api/resource'
import type { Job, JobSpec, PreferencesSpec } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { navigate } from '../../router/navigation'
import { jobPath } from '../../router/routes'

export function SearchButton({ job }: { job: Job }) {
  const { busy, error, during } = useCommand()
  const submit = () =>
    during(post('/v1/jobs', { body: searchAround(job) }).then(({ id }) => navigate(jobPath(id))))
  return (
    <>
      <button type="button" class="compact" disabled={busy} onClick={submit}>
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
