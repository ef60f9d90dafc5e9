/** Jobs beside each other: how they converged, how their designs are spread, how their specs differ. */

import { get } from '../api/client'
import { usePolling, useResource } from '../api/resource'
import type { JobComparison } from '../api/types'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { StateBadge } from '../components/state-badge'
import { Table } from '../components/table/table'
import { formatCount, formatNumber, NONE, percent } from '../format/number'
import { isUnderWay } from '../job/state'
import { ALL_JOBS, Breadcrumbs } from '../router/breadcrumbs'
import { usePlace } from '../router/navigation'
import { idsOf } from '../router/query-value'
import { jobPath } from '../router/routes'
import { ConvergenceCard } from './convergence-card'
import { DistributionCard } from './distribution-card'
import { type ComparedJob, colourOf } from './series'
import './compare.css'

/** How often jobs under way are asked for again [ms]. */
const RENEW_MS = 4000
/** Jobs that the title names at most. */
const NAMED = 3

export default function ComparePage() {
  const { query } = usePlace()
  const ids = idsOf(query.get('jobs'))
  const [first, ...also] = ids
  const found = useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    get('/v1/jobs/{job_id}/comparison', { path: { job_id: first }, query: { also }, signal }),
  )
  usePolling(found.reload, RENEW_MS, found.data?.jobs.some(isUnderWay) ?? false)
  return (
    <>
      <Breadcrumbs
        crumbs={[ALL_JOBS]}
        here="Compared jobs"
        title={found.data ? titleOf(found.data.jobs) : undefined}
      />
      <header class="page-header">
        <h1>Compared jobs</h1>
      </header>
      <div class="stack">
        {ids.length === 0 && (
          <section class="card">
            <Empty title="No job is chosen">
              <p>
                Choose some in the <a href="/jobs">list of jobs</a>.
              </p>
            </Empty>
          </section>
        )}
        {found.error && (
          <ErrorNotice
            what="The jobs cannot be compared."
            error={found.error}
            retry={found.reload}
          />
        )}
        {found.loading && !found.data && <Loading what="the jobs" />}
        {found.data && <Comparison found={found.data} />}
      </div>
    </>
  )
}

/** The jobs by name, a few of many, and how many are under way. */
function titleOf(jobs: readonly ComparedJob[]): readonly string[] {
  const names = jobs.slice(0, NAMED).map(({ name, id }) => name || id)
  if (jobs.length > NAMED) names.push(`${jobs.length - NAMED} more`)
  const running = jobs.filter(isUnderWay).length
  return [names.join(', '), ...(running > 0 ? [`${running} running`] : []), 'compared']
}

function Comparison({ found }: { found: JobComparison }) {
  return (
    <>
      {!found.comparable && (
        <div class="notice" data-tone="warn" role="status" data-comparable="false">
          <strong>They judge by different measures.</strong>
          <p>Their fitness is not the same quantity: see what their specs say differently.</p>
        </div>
      )}
      <section class="card" aria-labelledby="compared">
        <h2 id="compared">The jobs</h2>
        <Table
          caption="Compared jobs"
          rows={found.jobs}
          rowKey={({ id }) => id}
          rowData={({ id }) => ({ 'data-compared': id })}
          columns={[
            {
              key: 'name',
              label: 'Job',
              header: true,
              value: ({ name, id }) => name || id,
              cell: (job) => (
                <>
                  <i
                    class="compared-mark"
                    style={{ background: `var(${colourOf(found.jobs.indexOf(job))})` }}
                    aria-hidden="true"
                  />
                  <a href={jobPath(job.id)}>{job.name || job.id}</a>
                </>
              ),
            },
            {
              key: 'state',
              label: 'State',
              value: ({ state }) => state,
              cell: ({ state }) => <StateBadge state={state} />,
            },
            {
              key: 'best',
              label: 'Best fitness',
              numeric: true,
              value: ({ best_fitness }) => best_fitness,
              cell: ({ best_fitness }) => formatNumber(best_fitness, 5),
            },
            {
              key: 'gain',
              label: 'Gain',
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
              label: 'Evaluations',
              numeric: true,
              value: ({ evaluations }) => evaluations,
              cell: ({ evaluations }) => formatCount(evaluations),
            },
            {
              key: 'failed',
              minor: true,
              label: 'Failed',
              numeric: true,
              value: ({ failed, evaluations }) => failed / evaluations,
              cell: ({ failed, evaluations }) =>
                evaluations === 0 ? NONE : percent(failed / evaluations, 2),
            },
          ]}
        />
      </section>
      <ConvergenceCard jobs={found.jobs} comparable={found.comparable} />
      <DistributionCard jobs={found.jobs} />
      <Differences found={found} />
    </>
  )
}

function Differences({ found: { jobs, differences } }: { found: JobComparison }) {
  return (
    <section class="card" aria-labelledby="differences" data-differences={differences.length}>
      <h2 id="differences">What their specs say differently</h2>
      {differences.length === 0 ? (
        <Empty title="Nothing">
          <p>Their specs are the same.</p>
        </Empty>
      ) : (
        <Table
          caption="Differences of the specs"
          rows={differences}
          rowKey={({ field }) => field}
          columns={[
            {
              key: 'field',
              label: 'Field',
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
    </section>
  )
}
