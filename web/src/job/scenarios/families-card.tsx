/** Which scenarios of a job matter: what it would have found without each, and the fewest that do. */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, ScenarioFamilies, ScenarioLeftOut, ScenarioLoss } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { exactQuantity, formatCount, formatNumber, NONE, percent } from '../../format/number'
import { withQuery } from '../../router/routes'
import { Where } from '../designs/selected-designs'

/** Largest regret of a smallest set, by choice. */
const TOLERANCES = [0.005, 0.01, 0.02, 0.05]

export function ScenarioFamiliesCard({ job }: { job: Job }) {
  const [tolerance, setTolerance] = useState(0.01)
  const found = useResource(`${job.id} ${job.best_iteration} ${tolerance}`, (signal) =>
    get('/v1/jobs/{job_id}/scenarios', { path: { job_id: job.id }, query: { tolerance }, signal }),
  )
  const { data } = found
  return (
    <section class="card" aria-labelledby="families" data-smallest={smallestOf(data)}>
      <header class="row spread">
        <h2 id="families">Which scenarios matter</h2>
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
      {found.error && (
        <ErrorNotice
          what="Which scenarios matter cannot be told."
          error={found.error}
          retry={found.reload}
        />
      )}
      {found.loading && !data && <Loading what="what fewer scenarios would have found" />}
      {data &&
        (data.left_out.length === 0 ? (
          <Empty title="One scenario only">
            <p>A job of several scenarios is told here which of them it needs.</p>
          </Empty>
        ) : (
          <Families job={job} found={data} />
        ))}
    </section>
  )
}

function smallestOf(found: ScenarioFamilies | null): string {
  return found?.smallest?.scenarios.join(' ') ?? ''
}

function Families({ job, found }: { job: Job; found: ScenarioFamilies }) {
  return (
    <div class="stack">
      <Smallest job={job} found={found} />
      <Table
        caption="What the job would have found without a scenario"
        rows={found.left_out}
        rowKey={({ scenario }) => scenario}
        rowData={({ scenario }) => ({ 'data-left-out': scenario })}
        columns={leftOutColumns(job)}
      />
      <Table
        caption="Sets of scenarios by their size"
        rows={found.sizes}
        rowKey={({ size }) => String(size)}
        columns={[
          { key: 'size', label: 'Scenarios', header: true, value: ({ size }) => size },
          {
            key: 'families',
            label: 'Sets looked at',
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
            label: 'Within what is tolerated',
            numeric: true,
            value: ({ within }) => within,
          },
        ]}
      />
      <p class="muted small">
        Regret: by how much the design that is best without a scenario is worse over all of them
        than the job’s best; in brackets its interval of 95&nbsp;%. From{' '}
        {formatCount(found.designs)} designs that were found by a search over all scenarios: a
        search over fewer goes elsewhere, so check it by a job of its own.
      </p>
    </div>
  )
}

function Smallest({
  job,
  found: { smallest, tolerance, scenarios },
}: {
  job: Job
  found: ScenarioFamilies
}) {
  if (!smallest) {
    return (
      <p>
        No smaller set of scenarios finds a design within {percent(tolerance, 1)} of the job’s best:
        it needs all {formatCount(scenarios.length)}.
      </p>
    )
  }
  const names = smallest.scenarios
  return (
    <div class="row spread">
      <p>
        <strong>{names.join(', ')}</strong> would have been enough: {formatCount(names.length)} of{' '}
        {formatCount(scenarios.length)} scenarios, whose best is {shareWords(smallest.regret.value)}{' '}
        worse over all ({intervalWords(smallest.regret)}).
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
      label: 'Loss in it',
      numeric: true,
      value: ({ loss }) => loss.value,
      cell: ({ loss }) => <LossCell loss={loss} />,
    },
    {
      key: 'similar',
      label: 'Most like it',
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
      label: 'Would have won',
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

/** In hundredths of a per cent; a design that fails has no share. */
function shareWords(share: number | null): string {
  return share === null ? 'fails' : exactQuantity(Math.round(share * 10_000) / 100, '%', 3)
}
