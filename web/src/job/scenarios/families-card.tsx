/** Scenarios that matter: regret without each, and the smallest sufficient set. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, ScenarioFamilies, ScenarioLeftOut, ScenarioLoss } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { exactQuantity, formatCount, formatNumber, NONE, percent } from '../../format/number'
import { withQuery } from '../../router/routes'
import { DesignLink } from '../columns'

const TOLERANCES = [0.005, 0.01, 0.02, 0.05]

export function ScenarioFamiliesCard({ job }: { job: Job }) {
  const [tolerance, setTolerance] = useState(0.01)
  const families = useResource(`${job.id} ${job.best_iteration} ${tolerance}`, (signal) =>
    get('/v1/jobs/{job_id}/scenarios', { path: { job_id: job.id }, query: { tolerance }, signal }),
  )
  return (
    <Card
      title="Required scenarios"
      data={{ 'data-smallest': families.data?.smallest?.scenarios.join(' ') ?? '' }}
      tools={
        <Select
          label="Tolerated regret"
          value={String(tolerance)}
          options={TOLERANCES.map((share) => [String(share), percent(share, 1)] as const)}
          onChoose={(share) => setTolerance(Number(share))}
        />
      }
    >
      <Loaded
        resource={families}
        what="results of fewer scenarios"
        failed="Could not analyse the scenarios."
      >
        {(data) =>
          data.left_out.length === 0 ? (
            <Empty title="Only one scenario">
              <p>This analysis requires a job with several scenarios.</p>
            </Empty>
          ) : (
            <Families job={job} families={data} />
          )
        }
      </Loaded>
    </Card>
  )
}

function Families({ job, families }: { job: Job; families: ScenarioFamilies }) {
  return (
    <div class="stack">
      <Smallest job={job} families={families} />
      <Table
        caption="Results without one scenario"
        rows={families.left_out}
        rowData={({ scenario }) => ({ 'data-left-out': scenario })}
        columns={leftOutColumns(job)}
      />
      <Table<ScenarioFamilies['sizes'][number]>
        caption="Sets of scenarios by size"
        rows={families.sizes}
        columns={[
          { key: 'scenarios', header: true, value: ({ size }) => size },
          { key: 'sets considered', numeric: true, value: ({ families }) => families },
          {
            key: 'median regret',
            numeric: true,
            value: ({ median }) => median,
            cell: ({ median }) => shareWords(median),
          },
          {
            key: 'worst',
            numeric: true,
            value: ({ worst }) => worst,
            cell: ({ worst }) => shareWords(worst),
          },
          { key: 'within tolerance', numeric: true, value: ({ within }) => within },
        ]}
      />
      <p class="muted small">
        Regret: how much worse than the job’s best the best design without a scenario is over all
        scenarios, with its 95&nbsp;% interval. Estimated from {formatCount(families.designs)}{' '}
        designs of a search over all scenarios. A search over fewer takes another course; confirm
        with a separate job.
      </p>
    </div>
  )
}

interface SmallestProps {
  job: Job
  families: ScenarioFamilies
}

function Smallest({ job, families: { smallest, tolerance, scenarios } }: SmallestProps) {
  if (!smallest) {
    return (
      <p>
        No smaller set of scenarios yields a design within {percent(tolerance, 1)} of the job’s
        best: all {formatCount(scenarios.length)} are required.
      </p>
    )
  }
  const names = smallest.scenarios
  return (
    <div class="row spread">
      <p>
        <strong>{names.join(', ')}</strong> would have sufficed: {formatCount(names.length)} of{' '}
        {formatCount(scenarios.length)} scenarios, whose best design is{' '}
        {shareWords(smallest.regret.value)} worse over all ({intervalWords(smallest.regret)}).
      </p>
      <a
        class="button compact"
        href={withQuery('/jobs/new', { clone: job.id, scenarios: names.join(',') })}
      >
        Start a job with these
      </a>
    </div>
  )
}

function leftOutColumns(job: Job): readonly Column<ScenarioLeftOut>[] {
  return [
    { key: 'without', header: true, value: ({ scenario }) => scenario },
    {
      key: 'regret over all',
      numeric: true,
      value: ({ family }) => family.regret.value,
      cell: ({ family }) => <LossCell loss={family.regret} />,
    },
    {
      key: 'loss in this scenario',
      numeric: true,
      value: ({ loss }) => loss.value,
      cell: ({ loss }) => <LossCell loss={loss} />,
    },
    {
      key: 'most similar',
      value: ({ similarity }) => similarity,
      cell: ({ similar, similarity }) =>
        similar === null ? NONE : `${similar} (${formatNumber(similarity, 2)})`,
    },
    { key: 'rank correlation', digits: 3, minor: true, value: ({ family }) => family.correlation },
    { key: 'winner', minor: true, cell: ({ family }) => <DesignLink job={job} {...family} /> },
  ]
}

function LossCell({ loss }: { loss: ScenarioLoss }) {
  if (loss.value === null) return <strong>fails</strong>
  return (
    <>
      {shareWords(loss.value)} <span class="muted small">({intervalWords(loss)})</span>
    </>
  )
}

function intervalWords({ low, high }: ScenarioLoss): string {
  return `${shareWords(low)} to ${shareWords(high)}`
}

/** Rounded to 0.01 %; null for a failed design. */
function shareWords(share: number | null): string {
  return share === null ? 'fails' : exactQuantity(Math.round(share * 10_000) / 100, '%', 3)
}
