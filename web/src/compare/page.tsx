/** Comparison of jobs: outcomes, walks, convergence, differences between specs. */

import { get } from '../api/client'
import { ApiProblem } from '../api/problem'
import { usePolling, useResource } from '../api/resource'
import type { Job, JobComparison, StoredJob } from '../api/types'
import { Card, EmptyCard, Loaded } from '../components/card'
import { Empty } from '../components/feedback'
import { StateBadge } from '../components/state'
import { Table } from '../components/table/table'
import { formatCount, NONE, percent, quantity } from '../format/number'
import { inWords } from '../format/words'
import { fitnessUnit, isActive } from '../job/facts'
import { MOST_COMPARED } from '../jobs/list-query'
import { ALL_JOBS, Breadcrumbs } from '../router/breadcrumbs'
import { usePlace } from '../router/navigation'
import { idsOf } from '../router/query-value'
import { type ComparedJob, ConvergenceCard, DistributionCard, JobName } from './charts'
import { Outcomes } from './outcomes'
import { specWords } from './spec-words'
import './compare.css'

/** Polling interval while a job is active [ms]. */
const RENEW_MS = 4000
const NAMED = 3

interface Compared {
  readonly jobs: readonly StoredJob[]
  /** Ids of deleted jobs. */
  readonly missing: readonly string[]
  readonly comparison: JobComparison | null
}

async function load(ids: readonly string[], signal: AbortSignal): Promise<Compared> {
  const loaded = await Promise.all(
    ids.map((id) =>
      get('/v1/jobs/{job_id}', { path: { job_id: id }, signal }).catch((error: unknown) => {
        if (error instanceof ApiProblem && error.status === 404) return null
        throw error
      }),
    ),
  )
  const jobs = loaded.filter((job) => job !== null)
  const missing = ids.filter((_, k) => loaded[k] === null)
  const [first, ...also] = jobs.map(({ id }) => id)
  if (first === undefined) return { jobs, missing, comparison: null }
  const path = { job_id: first }
  const comparison = await get('/v1/jobs/{job_id}/comparison', { path, query: { also }, signal })
  return { jobs, missing, comparison }
}

export default function ComparePage() {
  const { query } = usePlace()
  const ids = idsOf(query.get('jobs')).slice(0, MOST_COMPARED)
  const compared = useResource(ids.length === 0 ? null : ids.join(), (signal) => load(ids, signal))
  usePolling(compared.reload, RENEW_MS, compared.data?.jobs.some(isActive) ?? false)
  const comparison = compared.data?.comparison
  return (
    <>
      <Breadcrumbs
        crumbs={[ALL_JOBS]}
        here="Compared jobs"
        title={comparison ? titleOf(comparison.jobs) : undefined}
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
        <Loaded resource={compared} what="the jobs" failed="Could not compare the jobs.">
          {(data) => (
            <>
              {data.missing.length > 0 && (
                <div class="notice" data-tone="warn" role="status">
                  <p>Not found, perhaps deleted: {data.missing.join(', ')}.</p>
                </div>
              )}
              {data.comparison ? (
                <Comparison
                  comparison={data.comparison}
                  jobs={data.jobs}
                  scenario={query.get('scenario') ?? ''}
                />
              ) : (
                <EmptyCard title="None of these jobs exists">
                  <p>
                    Select others in the <a href="/jobs">list of jobs</a>.
                  </p>
                </EmptyCard>
              )}
            </>
          )}
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

interface ComparisonProps {
  comparison: JobComparison
  jobs: readonly StoredJob[]
  scenario: string
}

function Comparison({ comparison, jobs, scenario }: ComparisonProps) {
  const stored = new Map(jobs.map((job) => [job.id, job]))
  const kinds = new Set(jobs.map(({ kind }) => kind))
  const tuned = comparison.jobs.filter(({ id }) => stored.get(id)?.kind === 'tuning')
  // Kinds have no common scale.
  const charted = kinds.size > 1 ? tuned : comparison.jobs
  return (
    <>
      {!comparison.comparable && (
        <div class="notice" data-tone="warn" role="status" data-comparable="false">
          <strong>These jobs measure fitness differently.</strong>
          <p>
            Their fitness values are not comparable; compare their outcomes.
            {kinds.size > 1 && ' Charts show searches only.'}
          </p>
        </div>
      )}
      <Outcomes jobs={jobs.filter(({ kind }) => kind === 'tuning') as Job[]} scenario={scenario} />
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
              cell: (job) => <JobName job={job} index={comparison.jobs.indexOf(job)} />,
            },
            {
              key: 'state',
              value: ({ state }) => state,
              cell: ({ state }) => <StateBadge state={state} />,
            },
            ...(kinds.size > 1
              ? [{ key: 'kind', cell: ({ id }: ComparedJob) => stored.get(id)?.kind }]
              : []),
            {
              key: 'best fitness',
              numeric: true,
              // Sortable only if it is one quantity.
              value: comparison.comparable ? ({ best_fitness }) => best_fitness : undefined,
              cell: ({ id, best_fitness }) =>
                quantity(best_fitness, fitnessUnit(stored.get(id)!), 5),
            },
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
      <Differences comparison={comparison} />
      {charted.length > 0 && (
        <>
          <ConvergenceCard jobs={charted} comparable={comparison.comparable} />
          <DistributionCard jobs={charted} />
        </>
      )}
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
              cell: ({ field }) => inWords(field).replaceAll('.', ' › '),
            },
            ...jobs.map((job, k) => ({
              key: job.id,
              heading: <JobName job={job} index={k} />,
              label: job.name || job.id,
              cell: ({ values }: JobComparison['differences'][number]) => (
                <span class="spec-value">{specWords(values[k])}</span>
              ),
            })),
          ]}
        />
      )}
    </Card>
  )
}
