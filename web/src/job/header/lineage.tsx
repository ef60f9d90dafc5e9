/** Where a forked job comes from, and the jobs that were forked from it. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { JobSummary, StoredJob } from '../../api/types'
import { jobPath } from '../../router/routes'

/** More are found in the list of jobs. */
const SHOWN = 12

type Lineage = NonNullable<StoredJob['lineage']>

/** Comes after what can be pressed: nothing may move away under a finger when it arrives. */
export function Forks({ job }: { job: StoredJob }) {
  const forks = useResource(job.id, (signal) =>
    get('/v1/jobs', { query: { parent: job.id, limit: SHOWN + 1 }, signal }).then(
      (page) => page.items,
    ),
  )
  const found = forks.data ?? []
  return found.length === 0 ? null : (
    <p class="small" data-forks={found.length}>
      Forks:{' '}
      {found.slice(0, SHOWN).map((fork, index) => (
        <span key={fork.id}>
          {index > 0 && ', '}
          <a href={jobPath(fork.id)}>{fork.id}</a> <span class="muted">{forkWords(fork)}</span>
        </span>
      ))}
      {found.length > SHOWN && ' and more'}
    </p>
  )
}

export function Parent({ lineage }: { lineage: Lineage }) {
  return (
    <p class="small" data-parent={lineage.parent}>
      Fork of <a href={jobPath(lineage.parent)}>{lineage.parent}</a>
      {lineage.carried === 'search'
        ? `: goes on from its iteration ${lineage.from_iteration}${changedWords(lineage)}.`
        : `: a new search${changedWords(lineage)}, from the best designs of its iterations before ${
            lineage.from_iteration
          }, because ${lineage.reason}.`}
    </p>
  )
}

/** What is different: " with another preference". */
function changedWords({ changed }: Lineage): string {
  return changed.length > 0 ? ` with another ${changed.join(', ')}` : ''
}

function forkWords({ lineage }: JobSummary): string {
  return lineage ? `from iteration ${lineage.from_iteration}${changedWords(lineage)}` : ''
}
