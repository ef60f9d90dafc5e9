/** Robustness of a design over many worlds: failures, distribution of utility, worst worlds. */

import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type {
  Certificate,
  CertifiedScenario,
  Influence,
  Job,
  Proportion,
  Spread,
  World,
} from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { change, formatCount, formatNumber, percent } from '../../format/number'
import { inWords } from '../../format/words'
import { withQuery } from '../../router/routes'
import { isRunning } from '../state'
import { OtherEngine } from './other-engine'

/** Polling interval while the job runs [ms]. */
const RENEW_MS = 15_000

interface Row {
  readonly name: string
  readonly heldOut: boolean
  readonly failed: Proportion
  readonly spread: Spread
}

export function CertificatePanel({ job }: { job: Job }) {
  // The first evaluation is the nominal world.
  if (job.evaluations < 2) {
    return (
      <section class="card">
        <Empty title="No world yet">
          <p>The summary appears here once the first batch of worlds has been simulated.</p>
        </Empty>
      </section>
    )
  }
  return <Certified job={job} />
}

function Certified({ job }: { job: Job }) {
  const certificate = useResource(job.id, (signal) =>
    get('/v1/jobs/{job_id}/certificate', {
      path: { job_id: job.id },
      query: { most: 20 },
      signal,
    }),
  )
  usePolling(certificate.reload, RENEW_MS, isRunning(job))
  return (
    <div class="stack">
      {certificate.error && (
        <ErrorNotice
          what="Could not load the certificate."
          error={certificate.error}
          retry={certificate.reload}
        />
      )}
      {certificate.loading && !certificate.data && <Loading what="the certificate" />}
      {certificate.data && (
        <>
          <Scenarios certificate={certificate.data} />
          {Object.entries(certificate.data.engines ?? {}).map(([name, engine]) => (
            <OtherEngine key={name} name={name} engine={engine} objectives={job.objectives} />
          ))}
          <Worlds job={job} worlds={certificate.data.worst} />
          <Influences influences={certificate.data.influences} />
        </>
      )}
    </div>
  )
}

function Scenarios({ certificate }: { certificate: Certificate }) {
  const { failed, fell } = certificate
  return (
    <section class="card" aria-labelledby="certificate">
      <h2 id="certificate">Failures in {formatCount(certificate.worlds)} worlds</h2>
      <p data-failed={failed.count} data-fell={fell.count}>
        A simulation failed in <strong>{formatCount(failed.count)}</strong> of them
        {failed.count > 0 && <>; the robot fell in {formatCount(fell.count)}</>}. The probability of
        a failure in such a world is {percent(failed.low, 2)} to {percent(failed.high, 2)} (exact
        95&nbsp;% interval).
      </p>
      <Table
        caption="Utility by scenario"
        rows={rowsOf(certificate)}
        rowKey={({ name }) => name}
        columns={COLUMNS}
        rowData={({ name }) => ({ 'data-scenario': name })}
      />
      <p class="muted small table-note">
        Lower is better. CVaR is the mean of the worst 5&nbsp;% of worlds; a failure counts as the
        worst success. Held-out scenarios are not among those of table 4.2.
      </p>
    </section>
  )
}

function rowsOf(certificate: Certificate): readonly Row[] {
  const rowOf = ([name, scenario]: [string, CertifiedScenario]): Row => ({
    name,
    heldOut: scenario.held_out,
    failed: scenario.failed,
    spread: scenario.utility,
  })
  const all = {
    name: 'all',
    heldOut: false,
    failed: certificate.failed,
    spread: certificate.fitness,
  }
  return [...Object.entries(certificate.scenarios).map(rowOf), all]
}

const COLUMNS: readonly Column<Row>[] = [
  {
    key: 'scenario',
    label: 'Scenario',
    header: true,
    value: ({ name }) => name,
    cell: ({ name, heldOut }) => (heldOut ? `${name} (held out)` : name),
  },
  {
    key: 'failed',
    label: 'Failed',
    numeric: true,
    value: ({ failed }) => failed.count,
    cell: ({ failed }) => formatCount(failed.count),
  },
  {
    key: 'high',
    label: 'Failure rate at most',
    numeric: true,
    minor: true,
    value: ({ failed }) => failed.high,
    cell: ({ failed }) => percent(failed.high, 2),
  },
  spreadColumn('nominal', 'Nominal', ({ nominal }) => nominal),
  spreadColumn('median', 'Median', ({ quantiles }) => quantiles[2]),
  spreadColumn('upper', '95 %', ({ quantiles }) => quantiles[4]),
  spreadColumn('cvar', 'CVaR 95 %', ({ cvar }) => cvar),
  spreadColumn('worst', 'Worst', ({ worst }) => worst),
]

function spreadColumn(
  key: string,
  label: string,
  value: (spread: Spread) => number | null,
): Column<Row> {
  return {
    key,
    label,
    numeric: true,
    value: ({ spread }) => value(spread),
    cell: ({ spread }) => formatNumber(value(spread)),
  }
}

function Worlds({ job, worlds }: { job: Job; worlds: readonly World[] }) {
  const walk = ({ iteration, particle, scenario }: World) =>
    withQuery('/walk', { job: job.id, iteration, particle, scenario })
  const failures = (world: World) =>
    Object.entries(world.failures).map(([name, status]) => `${name} (${status})`)
  return (
    <section class="card" aria-labelledby="worlds">
      <h2 id="worlds">Worst worlds</h2>
      <Table
        caption="Worst worlds"
        rows={worlds}
        rowKey={({ world }) => String(world)}
        pageSize={10}
        columns={[
          {
            key: 'world',
            label: 'World',
            header: true,
            value: ({ world }) => world,
            cell: (world) => <a href={walk(world)}>{world.world}</a>,
          },
          {
            key: 'fitness',
            label: 'Fitness',
            numeric: true,
            value: ({ fitness }) => fitness,
            cell: ({ fitness }) => formatNumber(fitness),
          },
          {
            key: 'where',
            label: 'Failed in, or worst in',
            cell: (world) => failures(world).join(', ') || world.scenario,
          },
        ]}
      />
      <p class="muted small table-note">A world’s number links to its simulation.</p>
    </section>
  )
}

function Influences({ influences }: { influences: readonly Influence[] }) {
  if (influences.length === 0) return null
  return (
    <section class="card" aria-labelledby="influences">
      <h2 id="influences">Perturbations that correlate with poor fitness</h2>
      <Table
        caption="Rank correlation of perturbations with fitness"
        rows={influences}
        rowKey={({ name }) => name}
        columns={[
          {
            key: 'name',
            label: 'Perturbation',
            header: true,
            value: ({ name }) => name,
            cell: ({ name }) => inWords(name),
          },
          {
            key: 'correlation',
            label: 'Rank correlation',
            numeric: true,
            value: ({ correlation }) => Math.abs(correlation),
            cell: ({ correlation }) => change(correlation, '1', 2),
          },
          {
            key: 'interval',
            label: '95 % interval',
            numeric: true,
            cell: ({ low, high }) => `${change(low, '1', 2)} to ${change(high, '1', 2)}`,
          },
        ]}
      />
    </section>
  )
}
