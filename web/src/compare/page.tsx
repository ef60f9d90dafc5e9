/** Comparison of jobs: convergence, distribution of fitness, differences between specs. */

import { get } from '../api/client'
import { usePolling, useResource } from '../api/resource'
import type { JobComparison } from '../api/types'
import { Card, EmptyCard, Loaded } from '../components/card'
import { Empty } from '../components/feedback'
import { StateBadge } from '../components/state'
import { Table } from '../components/table/table'
import { formatCount, NONE, percent } from '../format/number'
import { isActive } from '../job/facts'
import { ALL_JOBS, Breadcrumbs } from '../router/breadcrumbs'
import { usePlace } from '../router/navigation'
import { idsOf } from '../router/query-value'
import { jobPath } from '../router/routes'
import { type ComparedJob, ConvergenceCard, colourOf, DistributionCard } from './charts'
import './compare.css'

/** Polling interval while a job is active [ms]. */
const RENEW_MS = 4000
const NAMED = 3

export default function ComparePage() {
  const { query } = usePlace()
  const ids = idsOf(query.get('jobs'))
  const [first, ...also] = ids
  const comparison = useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    get('/v1/jobs/{job_id}/comparison', { path: { job_id: first }, query: { also }, signal }),
  )
  usePolling(comparison.reload, RENEW_MS, comparison.data?.jobs.some(isActive) ?? false)
  return (
    <>
      <Breadcrumbs
        crumbs={[ALL_JOBS]}
        here="Compared jobs"
        title={comparison.data ? titleOf(comparison.data.jobs) : undefined}
      />
      <header class="page-header">
        <h1>Compared jobs</h1>
      </header>
      <div class="stack">
        {ids.length === 0 && (
          <EmptyCard title="No jobs selected">
            <p>
              Select jobs in the <a href="/jobs">list of jobs</a>.
            </p>
          </EmptyCard>
        )}
        <Loaded resource={comparison} what="the jobs" failed="Could not compare the jobs.">
          {(data) => <Comparison comparison={data} />}
        </Loaded>
      </div>
    </>
  )
}

function titleOf(jobs: readonly ComparedJob[]): readonly string[] {
  const names = jobs.slice(0, NAMED).map(({ name, id }) => name || id)
  if (jobs.length > NAMED) names.push(`${jobs.length - NAMED} more`)
  const running = jobs.filter(isActive).length
  return [names.join(', '), ...(running > 0 ? [`${running} running`] : []), 'compared']
}

function Comparison({ comparison }: { comparison: JobComparison }) {
  return (
    <>
      {!comparison.comparable && (
        <div class="notice" data-tone="warn" role="status" data-comparable="false">
          <strong>These jobs measure fitness differently.</strong>
          <p>Their fitness values are not comparable: see the differences between their specs.</p>
        </div>
      )}
      <Card title="The jobs">
        <Table
          caption="Compared jobs"
          rows={comparison.jobs}
          rowData={({ id }) => ({ 'data-compared': id })}
          columns={[
            {
              key: 'job',
              header: true,
              value: ({ name, id }) => name || id,
              cell: (job) => (
                <>
                  <i
                    class="compared-mark"
                    style={{ background: `var(${colourOf(comparison.jobs.indexOf(job))})` }}
                    aria-hidden="true"
                  />
                  <a href={jobPath(job.id)}>{job.name || job.id}</a>
                </>
              ),
            },
            {
              key: 'state',
              value: ({ state }) => state,
              cell: ({ state }) => <StateBadge state={state} />,
            },
            { key: 'best fitness', digits: 5, value: ({ best_fitness }) => best_fitness },
            {
              key: 'gain',
              numeric: true,
              value: ({ gain }) => gain ?? null,
              cell: ({ gain, reference }) =>
                typeof gain === 'number' && reference
                  ? `${percent(gain, 3)} over ${reference.name}`
                  : NONE,
            },
            {
              key: 'evaluations',
              minor: true,
              numeric: true,
              value: ({ evaluations }) => evaluations,
              cell: ({ evaluations }) => formatCount(evaluations),
            },
            {
              key: 'failed',
              minor: true,
              percent: 2,
              value: ({ failed, evaluations }) => (evaluations === 0 ? null : failed / evaluations),
            },
          ]}
        />
      </Card>
      <ConvergenceCard jobs={comparison.jobs} comparable={comparison.comparable} />
      <DistributionCard jobs={comparison.jobs} />
      <Differences comparison={comparison} />
    </>
  )
}

function Differences({ comparison: { jobs, differences } }: { comparison: JobComparison }) {
  return (
    <Card title="Differences between specs">
      {differences.length === 0 ? (
        <Empty title="None">
          <p>All specs are identical.</p>
        </Empty>
      ) : (
        <Table
          caption="Differences between specs"
          rows={differences}
          columns={[
            {
              key: 'field',
              header: true,
              value: ({ field }) => field,
              cell: ({ field }) => <code>{field}</code>,
            },
            ...jobs.map(({ id, name }, k) => ({
              key: id,
              label: name || id,
              cell: ({ values }: JobComparison['differences'][number]) => (
                <code class="spec-value">{values[k] ?? NONE}</code>
              ),
            })),
          ]}
        />
      )}
    </Card>
  )
}
