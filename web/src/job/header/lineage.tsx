/** Parent and forks of a job. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { JobSummary, StoredJob } from '../../api/types'
import { jobPath } from '../../router/routes'

/** Most forks shown; the list of jobs has all of them. */
const SHOWN = 12

type Lineage = NonNullable<StoredJob['lineage']>

/** Placed last, so that its late arrival does not move buttons. */
export function Forks({ job }: { job: StoredJob }) {
  const forks = useResource(job.id, (signal) =>
    get('/v1/jobs', { query: { parent: job.id, limit: SHOWN + 1 }, signal }).then(
      (page) => page.items,
    ),
  )
  const forkList = forks.data ?? []
  return forkList.length === 0 ? null : (
    <p class="small" data-forks={forkList.length}>
      Forks:{' '}
      {forkList.slice(0, SHOWN).map((fork, index) => (
        <span key={fork.id}>
          {index > 0 && ', '}
          <a href={jobPath(fork.id)}>{fork.id}</a> <span class="muted">{forkWords(fork)}</span>
        </span>
      ))}
      {forkList.length > SHOWN && ' and more'}
    </p>
  )
}

export function Parent({ lineage }: { lineage: Lineage }) {
  return (
    <p class="small" data-parent={lineage.parent}>
      Fork of <a href={jobPath(lineage.parent)}>{lineage.parent}</a>
      {lineage.carried === 'search'
        ? `: continues from iteration ${lineage.from_iteration}${changedWords(lineage)}.`
        : `: a new search${changedWords(lineage)} from the best designs before iteration ${
            lineage.from_iteration
          }, because ${lineage.reason}.`}
    </p>
  )
}

/** What differs: " with another preference". */
function changedWords({ changed }: Lineage): string {
  return changed.length > 0 ? ` with another ${changed.join(', ')}` : ''
}

function forkWords({ lineage }: JobSummary): string {
  return lineage ? `from iteration ${lineage.from_iteration}${changedWords(lineage)}` : ''
}
