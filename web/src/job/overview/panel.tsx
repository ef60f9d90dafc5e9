/** Overview of a job: convergence, distribution, diversity, winner and limiting factors. */

import { EmptyCard } from '../../components/card'
import { ErrorNotice } from '../../components/feedback'
import { formatNumber, percent } from '../../format/number'
import { IterationChart } from '../by-iteration'
import type { PanelProps } from '../page'
import { ConvergenceChart } from './convergence-chart'
import { DistributionChart } from './distribution-chart'
import { LimitsCard } from './limits-card'
import { useDistribution } from './use-distribution'
import { WinnerCard } from './winner-card'
import './overview.css'

export function OverviewPanel({ live, job, gain: { reference } }: PanelProps) {
  const { iterations } = live.followed
  const distribution = useDistribution(job.id, iterations.length)
  if (iterations.length === 0) {
    return (
      <EmptyCard title={job.state === 'queued' ? 'Waiting for a runner' : 'No iteration yet'}>
        {job.state === 'queued'
          ? 'The job starts when a runner has capacity; this page updates automatically.'
          : 'The first iteration appears here once it is committed.'}
      </EmptyCard>
    )
  }
  return (
    <div class="stack">
      {distribution.error !== null && (
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
        <IterationChart
          title="Diversity of the designs"
          note={
            distribution.items.some(({ diversity }) => diversity !== null)
              ? 'Spread of the designs as a share of each variable’s range; near zero, the search has converged.'
              : 'The method evaluates one design at a time, which has no spread.'
          }
          label={`Diversity of the designs, now ${percent(distribution.items.at(-1)?.diversity)} of the range`}
          rows={distribution.items}
          name="diversity"
          yUnit="%"
          format={(value) => formatNumber(value, 3)}
          value={({ diversity }) => diversity && diversity * 100}
          colour="--series-3"
          zoomName="zoom-diversity"
          fromZero
        />
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
