/** Sobol’ indices of the variables, with confidence intervals. */

import type { Importance, VariableImportance } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { BrokenName } from '../../components/broken-name'
import { Empty } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatNumber, NONE, percent } from '../../format/number'
import { setQuery, usePlace } from '../../router/navigation'
import { byImportance, indexOf, type Output, outputsOf, outputWords } from './outputs'
import '../bars.css'

export function ImportanceCard({ importance }: { importance: Importance }) {
  const { query } = usePlace()
  const outputs = outputsOf(importance)
  const output = outputs.find((name) => name === query.get('of')) ?? 'fitness'
  const hasEstimate = importance.variables.some((variable) => indexOf(variable, output) !== null)
  return (
    <ChartCard
      title="Variable importance"
      note={`Share of the variance of ${outputWords(output)}, by rank, explained by each variable alone: first-order Sobol’ index with its 95 % interval as a line.`}
      tools={
        <label class="row small">
          <span>For</span>
          <select value={output} onChange={(event) => setQuery({ of: event.currentTarget.value })}>
            {outputs.map((name) => (
              <option key={name} value={name}>
                {outputWords(name)}
              </option>
            ))}
          </select>
        </label>
      }
      table={() => <ImportanceTable importance={importance} outputs={outputs} />}
    >
      {hasEstimate ? (
        <ul class="bars" data-output={output}>
          {byImportance(importance, output).map((variable) => (
            <Bar key={variable.name} variable={variable} output={output} />
          ))}
        </ul>
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

function Bar({ variable, output }: { variable: VariableImportance; output: Output }) {
  const index = indexOf(variable, output)
  const share = (part: number) => `${part * 100}%`
  return (
    <li data-variable={variable.name}>
      <span class="bar-name">
        <BrokenName name={variable.name} />
        <Companion variable={variable} />
      </span>
      <span class="bar">
        <span class="bar-track">
          {index && (
            <>
              <i
                class="bar-fill"
                style={{ width: share(index.value), background: 'var(--series-1)' }}
                aria-hidden="true"
              />
              <i
                class="bar-interval"
                style={{ left: share(index.low), width: share(index.high - index.low) }}
                aria-hidden="true"
              />
            </>
          )}
        </span>
        <span class="bar-value">{index ? percent(index.value, 2) : 'unknown'}</span>
      </span>
    </li>
  )
}

/** Correlation above which the importance of one of two variables may be spurious. */
const TOGETHER = 0.5

function Companion({ variable: { moved_with, correlation } }: { variable: VariableImportance }) {
  if (moved_with === null || Math.abs(correlation ?? 0) < TOGETHER) return null
  return (
    <span class="muted small">
      {' '}
      correlated with {moved_with} ({formatNumber(correlation, 2)})
    </span>
  )
}

function ImportanceTable({
  importance,
  outputs,
}: {
  importance: Importance
  outputs: readonly Output[]
}) {
  const columns: Column<VariableImportance>[] = [
    {
      key: 'name',
      label: 'Variable',
      header: true,
      value: ({ name }) => name,
      cell: ({ name }) => <BrokenName name={name} />,
    },
    ...outputs.map(
      (output): Column<VariableImportance> => ({
        key: output,
        label: outputWords(output),
        numeric: true,
        value: (variable) => indexOf(variable, output)?.value ?? null,
        cell: (variable) => <IndexCell variable={variable} output={output} />,
      }),
    ),
    {
      key: 'moved_with',
      label: 'Correlated with',
      value: ({ correlation }) => correlation,
      cell: ({ moved_with, correlation }) =>
        moved_with === null ? NONE : `${moved_with} (${formatNumber(correlation, 2)})`,
    },
  ]
  return (
    <Table
      caption="Importance of every variable"
      rows={importance.variables}
      rowKey={({ name }) => name}
      order={{ column: 'fitness', descending: true }}
      columns={columns}
    />
  )
}

function IndexCell({ variable, output }: { variable: VariableImportance; output: Output }) {
  const index = indexOf(variable, output)
  if (!index) return <>{NONE}</>
  return (
    <>
      {percent(index.value, 2)}{' '}
      <span class="muted small">
        ({percent(index.low, 2)} to {percent(index.high, 2)})
      </span>
    </>
  )
}
