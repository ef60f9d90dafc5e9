/** Overview of a job: convergence, distribution, diversity, winner and limiting factors. */

import type { Job } from '../../api/types'
import { Empty, ErrorNotice } from '../../components/feedback'
import type { Gain } from '../gain'
import type { LiveJob } from '../live/use-job'
import { ConvergenceChart } from './convergence-chart'
import { DistributionChart } from './distribution-chart'
import { DiversityChart } from './diversity-chart'
import { LimitsCard } from './limits-card'
import { useDistribution } from './use-distribution'
import { WinnerCard } from './winner-card'
import './overview.css'

export function OverviewPanel({
  live,
  job,
  reference,
}: {
  live: LiveJob
  job: Job
  reference: Gain['reference']
}) {
  const { iterations } = live.followed
  const distribution = useDistribution(job.id, iterations.length)
  if (iterations.length === 0) {
    return (
      <section class="card">
        <Empty title={job.state === 'queued' ? 'Waiting for a runner' : 'No iteration yet'}>
          <p>
            {job.state === 'queued'
              ? 'The job starts when a runner has capacity; this page updates automatically.'
              : 'The first iteration appears here once it is committed.'}
          </p>
        </Empty>
      </section>
    )
  }
  return (
    <div class="stack">
      {distribution.error !== null && distribution.error !== undefined && (
        <ErrorNotice
          what="Could not load the distribution of fitness."
          error={distribution.error}
        />
      )}
      <ConvergenceChart
        job={job}
        iterations={iterations}
        distribution={distribution}
        reference={reference}
      />
      <div class="grid">
        <DistributionChart job={job} iterations={iterations} distribution={distribution} />
        <DiversityChart distribution={distribution} />
      </div>
      {job.best && job.kind !== 'certificate' && (
        <>
          <WinnerCard job={job} />
          {job.spec.kind === 'tuning' && !job.spec.worlds && (
            <LimitsCard job={job} spec={job.spec} />
          )}
        </>
      )}
    </div>
  )
}
