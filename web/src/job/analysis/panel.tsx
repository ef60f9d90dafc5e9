/** Analysis of a job: importance of its variables, and active bounds. */

import { get } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Importance, ImportanceIndex, Job, VariableImportance } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { BrokenName } from '../../components/text'
import {
  exactQuantity,
  formatCount,
  formatExact,
  formatNumber,
  NONE,
  percent,
} from '../../format/number'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { Bars } from '../bars'
import { VARIABLE } from '../columns'

const RENEW_MS = 8000

/** Correlation above which the importance of one of two variables may be spurious. */
const CORRELATED = 0.5

export default function AnalysisPanel({ job }: { job: Job }) {
  const iterations = useSlowly(job.iterations, RENEW_MS)
  const importance = useResource(
    job.iterations === 0 ? null : `${job.id} ${iterations}`,
    (signal) => get('/v1/jobs/{job_id}/importance', { path: { job_id: job.id }, signal }),
    { keep: true },
  )
  if (job.iterations === 0) {
    return (
      <EmptyCard title="Nothing to analyse yet">
        Variable importance appears here after the first iteration.
      </EmptyCard>
    )
  }
  return (
    <div class="stack">
      <Loaded resource={importance} what="the variable importance">
        {(data) => (
          <>
            <ImportanceCard importance={data} />
            <BoundsCard job={job} importance={data} />
          </>
        )}
      </Loaded>
    </div>
  )
}

/** Importance of a variable for an output: `fitness`, `failing` or an objective. */
function indexOf(variable: VariableImportance, output: string): ImportanceIndex | null {
  if (output === 'fitness' || output === 'failing') return variable[output]
  return variable.objectives[output] ?? null
}

/** Sobol’ indices of the variables, with confidence intervals. */
function ImportanceCard({ importance }: { importance: Importance }) {
  const { query } = usePlace()
  const { variables } = importance
  const hasEstimate = (output: string) => variables.some((v) => indexOf(v, output) !== null)
  const outputs = [
    'fitness',
    ...[...importance.objectives, 'failing'].filter((output) => hasEstimate(output)),
  ]
  const output = outputs.find((name) => name === query.get('of')) ?? 'fitness'
  const value = (variable: VariableImportance) => indexOf(variable, output)?.value ?? -1
  const rows = [...variables].sort((a, b) => value(b) - value(a))
  return (
    <ChartCard
      title="Variable importance"
      note={`Share of the variance of ${inWords(output)}, by rank, explained by each variable alone: first-order Sobol’ index with its 95 % interval as a line.`}
      tools={
        <Select
          label="For"
          value={output}
          options={outputs.map((name) => [name, inWords(name)] as const)}
          onChoose={(of) => setQuery({ of })}
        />
      }
      table={() => (
        <Table
          caption="Importance of every variable"
          rows={variables}
          order={{ column: 'fitness', descending: true }}
          columns={importanceColumns(outputs)}
        />
      )}
    >
      {hasEstimate(output) ? (
        <Bars
          output={output}
          most={1}
          rows={rows.map((variable) => {
            const index = indexOf(variable, output)
            const text = index ? percent(index.value, 2) : 'unknown'
            return {
              name: variable.name,
              label: <VariableLabel variable={variable} />,
              bars: [{ value: index?.value ?? null, text, interval: index }],
            }
          })}
        />
      ) : (
        <Empty title="Not enough designs yet">
          <p>
            {formatCount(importance.designs)} designs walk in every scenario. The estimate needs
            about twenty with different values.
          </p>
        </Empty>
      )}
      <p class="muted small table-note">
        Based on {formatCount(importance.sampled)} designs of the search; failed ones count only
        towards failing. The search does not sample independently: correlated variables share their
        effect, and interactions between variables are not included.
      </p>
    </ChartCard>
  )
}

function VariableLabel({
  variable: { name, moved_with, correlation },
}: {
  variable: VariableImportance
}) {
  return (
    <>
      <BrokenName name={name} />
      {moved_with !== null && Math.abs(correlation ?? 0) >= CORRELATED && (
        <span class="muted small">
          {' '}
          correlated with {moved_with} ({formatNumber(correlation, 2)})
        </span>
      )}
    </>
  )
}

function importanceColumns(outputs: readonly string[]): readonly Column<VariableImportance>[] {
  return [
    VARIABLE,
    ...outputs.map(
      (output): Column<VariableImportance> => ({
        key: output,
        label: inWords(output),
        numeric: true,
        value: (variable) => indexOf(variable, output)?.value ?? null,
        cell: (variable) => {
          const index = indexOf(variable, output)
          if (!index) return NONE
          return (
            <>
              {percent(index.value, 2)}{' '}
              <span class="muted small">
                ({percent(index.low, 2)} to {percent(index.high, 2)})
              </span>
            </>
          )
        },
      }),
    ),
    {
      key: 'correlated with',
      value: ({ correlation }) => correlation,
      cell: ({ moved_with, correlation }) =>
        moved_with === null ? NONE : `${moved_with} (${formatNumber(correlation, 2)})`,
    },
  ]
}

interface BoundsCardProps {
  job: Job
  importance: Importance
}

/** Bounds that the winner touches, with a link to search beyond them. */
function BoundsCard({ job, importance: { variables, iteration } }: BoundsCardProps) {
  const active = variables.filter(({ at }) => at !== null)
  const widen = variables
    .flatMap(({ name, widened }) => (widened ? [`${name}:${widened.low}:${widened.high}`] : []))
    .join()
  return (
    <Card
      title="Active bounds"
      data={{ 'data-active-bounds': active.map(({ name }) => name).join(' ') }}
      tools={
        widen !== '' && (
          <a class="button" href={withQuery('/jobs/new', { clone: job.id, widen })}>
            Widen and run again
          </a>
        )
      }
    >
      {active.length === 0 ? (
        <Empty title={iteration === null ? 'No winner yet' : 'None'}>
          <p>
            {iteration === null
              ? 'The active bounds appear here once a design has walked in every scenario.'
              : 'The winner is at least 1 % of the range away from every bound.'}
          </p>
        </Empty>
      ) : (
        <Table<VariableImportance>
          caption="Variables with the winner at a bound"
          rows={active}
          columns={[
            VARIABLE,
            {
              key: 'winner',
              numeric: true,
              value: ({ winner }) => winner,
              cell: ({ winner, unit }) => exactQuantity(winner, unit),
            },
            { key: 'bound', value: ({ at }) => at },
            { key: 'search bounds', cell: rangeInWords },
            {
              key: 'wider bounds',
              cell: ({ widened }) =>
                widened ? rangeInWords(widened) : 'none that can be simulated',
            },
          ]}
        />
      )}
    </Card>
  )
}

function rangeInWords({ low, high }: { low: number; high: number }): string {
  return `${formatExact(low)} to ${formatExact(high)}`
}
