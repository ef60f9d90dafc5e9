/** Scenarios that matter: regret without each, and the smallest sufficient set. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, ScenarioFamilies, ScenarioLeftOut, ScenarioLoss } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { exactQuantity, formatCount, formatNumber, NONE, percent } from '../../format/number'
import { withQuery } from '../../router/routes'
import { Where } from '../designs/selected-designs'

/** Choices for the largest tolerated regret. */
const TOLERANCES = [0.005, 0.01, 0.02, 0.05]

export function ScenarioFamiliesCard({ job }: { job: Job }) {
  const [tolerance, setTolerance] = useState(0.01)
  const families = useResource(`${job.id} ${job.best_iteration} ${tolerance}`, (signal) =>
    get('/v1/jobs/{job_id}/scenarios', { path: { job_id: job.id }, query: { tolerance }, signal }),
  )
  const { data } = families
  return (
    <section class="card" aria-labelledby="families" data-smallest={smallestOf(data)}>
      <header class="row spread">
        <h2 id="families">Required scenarios</h2>
        <label class="row small">
          <span>Tolerated regret</span>
          <select
            value={String(tolerance)}
            onChange={(event) => setTolerance(Number(event.currentTarget.value))}
          >
            {TOLERANCES.map((share) => (
              <option key={share} value={String(share)}>
                {percent(share, 1)}
              </option>
            ))}
          </select>
        </label>
      </header>
      {families.error && (
        <ErrorNotice
          what="Could not analyse the scenarios."
          error={families.error}
          retry={families.reload}
        />
      )}
      {families.loading && !data && <Loading what="results of fewer scenarios" />}
      {data &&
        (data.left_out.length === 0 ? (
          <Empty title="Only one scenario">
            <p>This analysis requires a job with several scenarios.</p>
          </Empty>
        ) : (
          <Families job={job} families={data} />
        ))}
    </section>
  )
}

function smallestOf(families: ScenarioFamilies | null): string {
  return families?.smallest?.scenarios.join(' ') ?? ''
}

function Families({ job, families }: { job: Job; families: ScenarioFamilies }) {
  return (
    <div class="stack">
      <Smallest job={job} families={families} />
      <Table
        caption="Results without one scenario"
        rows={families.left_out}
        rowKey={({ scenario }) => scenario}
        rowData={({ scenario }) => ({ 'data-left-out': scenario })}
        columns={leftOutColumns(job)}
      />
      <Table
        caption="Sets of scenarios by size"
        rows={families.sizes}
        rowKey={({ size }) => String(size)}
        columns={[
          { key: 'size', label: 'Scenarios', header: true, value: ({ size }) => size },
          {
            key: 'families',
            label: 'Sets considered',
            numeric: true,
            value: ({ families }) => families,
          },
          {
            key: 'median',
            label: 'Median regret',
            numeric: true,
            value: ({ median }) => median,
            cell: ({ median }) => shareWords(median),
          },
          {
            key: 'worst',
            label: 'Worst',
            numeric: true,
            value: ({ worst }) => worst,
            cell: ({ worst }) => shareWords(worst),
          },
          {
            key: 'within',
            label: 'Within tolerance',
            numeric: true,
            value: ({ within }) => within,
          },
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

function Smallest({
  job,
  families: { smallest, tolerance, scenarios },
}: {
  job: Job
  families: ScenarioFamilies
}) {
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
    { key: 'scenario', label: 'Without', header: true, value: ({ scenario }) => scenario },
    {
      key: 'regret',
      label: 'Regret over all',
      numeric: true,
      value: ({ family }) => family.regret.value,
      cell: ({ family }) => <LossCell loss={family.regret} />,
    },
    {
      key: 'loss',
      label: 'Loss in this scenario',
      numeric: true,
      value: ({ loss }) => loss.value,
      cell: ({ loss }) => <LossCell loss={loss} />,
    },
    {
      key: 'similar',
      label: 'Most similar',
      value: ({ similarity }) => similarity,
      cell: ({ similar, similarity }) =>
        similar === null ? NONE : `${similar} (${formatNumber(similarity, 2)})`,
    },
    {
      key: 'correlation',
      label: 'Rank correlation',
      numeric: true,
      minor: true,
      value: ({ family }) => family.correlation,
      cell: ({ family }) => formatNumber(family.correlation, 3),
    },
    {
      key: 'winner',
      label: 'Winner',
      minor: true,
      cell: ({ family }) => <Where job={job} {...family} />,
    },
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
