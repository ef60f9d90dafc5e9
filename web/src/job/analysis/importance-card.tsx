/** How much of an output goes with each variable alone, with intervals. */

import type { Importance, VariableImportance } from '../../api/types'
import { ChartFrame } from '../../charts/chart-frame'
import { BrokenName } from '../../components/broken-name'
import { Empty } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatNumber, NONE, percent } from '../../format/number'
import { setQuery, usePlace } from '../../router/navigation'
import { byImportance, indexOf, type Output, outputsOf, outputWords } from './outputs'
import '../bars.css'

export function ImportanceCard({ found }: { found: Importance }) {
  const { query } = usePlace()
  const outputs = outputsOf(found)
  const output = outputs.find((name) => name === query.get('of')) ?? 'fitness'
  const known = found.variables.some((variable) => indexOf(variable, output) !== null)
  return (
    <ChartFrame
      title="Which variables matter"
      note={`Share of the variance of ${outputWords(output)}, by rank, that goes with a variable alone: first-order Sobol’ index, its interval of 95 % as a line.`}
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
      table={() => <ImportanceTable found={found} outputs={outputs} />}
    >
      {known ? (
        <ul class="bars" data-output={output}>
          {byImportance(found, output).map((variable) => (
            <Bar key={variable.name} variable={variable} output={output} />
          ))}
        </ul>
      ) : (
        <Empty title="Too little is known yet">
          <p>
            {formatCount(found.designs)} designs walk in every case; from some twenty on that differ
            in what they are worth, it is told here what goes with which variable.
          </p>
        </Empty>
      )}
      <p class="muted small table-note">
        Among {formatCount(found.sampled)} designs that the search tried, of which those that fail
        count for failing alone. A search does not draw at random: variables that moved together
        share what either does, and what two do only together is in neither.
      </p>
    </ChartFrame>
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
        <span class="bar-value">{index ? percent(index.value, 2) : 'not known'}</span>
      </span>
    </li>
  )
}

/** A correlation from which on one of two variables may only seem to matter. */
const TOGETHER = 0.5

function Companion({ variable: { moved_with, correlation } }: { variable: VariableImportance }) {
  if (moved_with === null || Math.abs(correlation ?? 0) < TOGETHER) return null
  return (
    <span class="muted small">
      {' '}
      moved with {moved_with} ({formatNumber(correlation, 2)})
    </span>
  )
}

function ImportanceTable({ found, outputs }: { found: Importance; outputs: readonly Output[] }) {
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
      label: 'Moved with',
      value: ({ correlation }) => correlation,
      cell: ({ moved_with, correlation }) =>
        moved_with === null ? NONE : `${moved_with} (${formatNumber(correlation, 2)})`,
    },
  ]
  return (
    <Table
      caption="Importance of every variable"
      rows={found.variables}
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
