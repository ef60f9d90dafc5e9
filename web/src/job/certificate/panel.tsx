/** Robustness of a design over many worlds: failures, distribution of utility, worst worlds. */

import { useResource, useSlowly } from '../../api/resource'
import type {
  Certificate,
  Compared,
  ComparedEngine,
  Influence,
  Job,
  Proportion,
  Spread,
  World,
} from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { type Column, Table } from '../../components/table/table'
import { change, formatNumber, withUnit } from '../../format/number'
import { inWords } from '../../format/words'
import { withQuery } from '../../router/routes'
import { loadCertificate } from '../outcome'
import { Failures } from './failures'

const RENEW_MS = 15_000

export default function CertificatePanel({ job }: { job: Job }) {
  // The first evaluation is the nominal world.
  const exists = job.evaluations >= 2
  const evaluations = useSlowly(job.evaluations, RENEW_MS)
  const certificate = useResource(
    exists ? `${job.id} ${evaluations}` : null,
    () => loadCertificate({ id: job.id, evaluations }),
    { keep: true },
  )
  if (!exists) {
    return (
      <EmptyCard title="No world yet">
        The summary appears here once the first batch of worlds has been simulated.
      </EmptyCard>
    )
  }
  return (
    <div class="stack">
      <Loaded resource={certificate} what="the certificate">
        {(data) => (
          <>
            <section class="card headline-card" aria-label="Verdict">
              <Failures certificate={data} id={job.id} />
            </section>
            <Scenarios certificate={data} />
            {Object.entries(data.engines ?? {}).map(([name, engine]) => (
              <OtherEngine key={name} name={name} engine={engine} objectives={job.objectives} />
            ))}
            <div class="grid">
              <Worlds job={job} worlds={data.worst} />
              <Influences influences={data.influences} />
            </div>
          </>
        )}
      </Loaded>
    </div>
  )
}

interface Row {
  readonly name: string
  readonly heldOut: boolean
  readonly failed: Proportion
  readonly spread: Spread
}

function Scenarios({ certificate }: { certificate: Certificate }) {
  const { failed, fitness } = certificate
  const rows = Object.entries(certificate.scenarios).map(
    ([name, { held_out: heldOut, failed, utility: spread }]): Row => ({
      name,
      heldOut,
      failed,
      spread,
    }),
  )
  return (
    <Card title="Utility by scenario">
      <Table
        caption="Utility by scenario"
        rows={[...rows, { name: 'all', heldOut: false, failed, spread: fitness }]}
        columns={SCENARIO_COLUMNS}
        rowData={({ name }) => ({ 'data-scenario': name })}
      />
      <p class="muted small table-note">
        Lower is better. CVaR is the mean of the worst 5&nbsp;% of worlds; a failure counts as the
        worst success. Held-out scenarios are not among those of table 4.2.
      </p>
    </Card>
  )
}

const SCENARIO_COLUMNS: readonly Column<Row>[] = [
  {
    key: 'scenario',
    header: true,
    value: ({ name }) => name,
    cell: ({ name, heldOut }) => (heldOut ? `${name} (held out)` : name),
  },
  { key: 'failed', digits: 1, value: ({ failed }) => failed.count },
  { key: 'failure rate at most', percent: 2, minor: true, value: ({ failed }) => failed.high },
  { key: 'nominal', digits: 4, value: ({ spread }) => spread.nominal },
  { key: 'median', digits: 4, value: ({ spread }) => spread.quantiles[2] },
  { key: '95 %', digits: 4, value: ({ spread }) => spread.quantiles[4] },
  { key: 'CVaR 95 %', digits: 4, value: ({ spread }) => spread.cvar },
  { key: 'worst', digits: 4, value: ({ spread }) => spread.worst },
]

function Worlds({ job, worlds }: { job: Job; worlds: readonly World[] }) {
  return (
    <Card title="Worst worlds">
      <Table<World>
        caption="Worst worlds"
        rows={worlds}
        pageSize={10}
        columns={[
          {
            key: 'world',
            header: true,
            value: ({ world }) => world,
            cell: ({ world, iteration, particle, scenario }) => (
              <a href={withQuery('/walk', { job: job.id, iteration, particle, scenario })}>
                {world}
              </a>
            ),
          },
          { key: 'fitness', digits: 4, value: ({ fitness }) => fitness },
          {
            key: 'failed in, or worst in',
            cell: ({ failures, scenario }) =>
              Object.entries(failures)
                .map(([name, status]) => `${name} (${status})`)
                .join(', ') || scenario,
          },
        ]}
      />
      <p class="muted small table-note">A world’s number links to its simulation.</p>
    </Card>
  )
}

function Influences({ influences }: { influences: readonly Influence[] }) {
  if (influences.length === 0) return null
  return (
    <Card title="Perturbations that correlate with poor fitness">
      <Table<Influence>
        caption="Rank correlation of perturbations with fitness"
        rows={influences}
        columns={[
          { key: 'perturbation', header: true, value: ({ name }) => inWords(name) },
          {
            key: 'rank correlation',
            numeric: true,
            value: ({ correlation }) => Math.abs(correlation),
            cell: ({ correlation }) => change(correlation, '1', 2),
          },
          {
            key: '95 % interval',
            numeric: true,
            cell: ({ low, high }) => `${change(low, '1', 2)} to ${change(high, '1', 2)}`,
          },
        ]}
      />
    </Card>
  )
}

interface ComparedRow {
  /** With both final statuses, if either failed. */
  readonly scenario: string
  readonly quantity: string
  readonly compared: Compared
}

/** The nominal world in another physics engine, compared with gaitswarm. */
function OtherEngine({
  name,
  engine: { description, fitness, scenarios },
  objectives,
}: {
  name: string
  engine: ComparedEngine
  objectives: Job['objectives']
}) {
  const entries = Object.entries(scenarios)
  const rows = entries.flatMap(([scenario, result]): ComparedRow[] => {
    const { ours, theirs, utility } = result
    const label = ours === 'ok' && theirs === 'ok' ? scenario : `${scenario} (${ours}, ${theirs})`
    const measured = objectives.flatMap(({ name, unit }) => {
      const compared = result.objectives[name]
      const quantity = withUnit(inWords(name), unit)
      return compared ? [{ scenario: label, quantity, compared }] : []
    })
    return [...measured, { scenario: label, quantity: 'utility', compared: utility }]
  })
  return (
    <Card title={<>Nominal world in {name}</>} data={{ 'data-engine': name }}>
      <p>
        {description}. <strong>{entries.filter(([, { theirs }]) => theirs === 'ok').length}</strong>{' '}
        of {entries.length} scenarios succeed, with a fitness of {formatNumber(fitness.theirs)}{' '}
        instead of {formatNumber(fitness.ours)}: {differenceInWords(fitness)}.
      </p>
      <Table<ComparedRow>
        caption={`Scenarios and objectives in ${name}`}
        rows={rows}
        columns={[
          { key: 'scenario', header: true, value: ({ scenario }) => scenario },
          { key: 'objective', value: ({ quantity }) => quantity },
          {
            key: 'gaitswarm',
            label: 'gaitswarm',
            digits: 4,
            value: ({ compared }) => compared.ours,
          },
          { key: 'theirs', label: name, digits: 4, value: ({ compared }) => compared.theirs },
          {
            key: 'difference',
            numeric: true,
            value: ({ compared: { difference } }) => difference && Math.abs(difference),
            cell: ({ compared }) => differenceInWords(compared),
          },
        ]}
        pageSize={2 * (objectives.length + 1)}
      />
    </Card>
  )
}

function differenceInWords({ difference }: Compared): string {
  return change(difference === null ? null : 100 * difference, '%', 2)
}
