/** Table of the fitted parameters: values, interval widths, verdicts. */

import type { FittedParameter, Identifiability } from '../../api/types'
import { BrokenName } from '../../components/broken-name'
import { type Column, Table } from '../../components/table/table'
import { formatExact, percent, writtenUnit } from '../../format/number'
import { formatValue } from '../../format/value'
import { inWords } from '../../format/words'
import { LISTED, rankOf, widthAt } from './intervals'
import { TrustBadge } from './verdicts'

export function ParametersTable({
  identifiability,
  shown,
  labels,
  agreement,
}: {
  identifiability: Identifiability
  shown: readonly FittedParameter[]
  /** Labels of the runs. */
  labels: readonly string[]
  /** Description of the designs among which agreement is judged. */
  agreement: string
}) {
  return (
    <section class="card" aria-labelledby="fitted">
      <header>
        <h2 id="fitted">Parameters</h2>
        <p class="muted small">
          Widths are shares of the search range, among designs with a fitness within 20, 10, 5 and
          2&nbsp;% of their run’s best. Verdicts state the agreement {agreement}, not correctness.
        </p>
      </header>
      <Table
        caption="Fitted parameters"
        rows={shown}
        rowKey={({ name }) => name}
        columns={columns(identifiability, labels)}
        rowData={({ name, trust }) => ({ 'data-parameter': name, 'data-verdict': trust ?? 'none' })}
        pageSize={60}
      />
    </section>
  )
}

function columns(
  identifiability: Identifiability,
  labels: readonly string[],
): readonly Column<FittedParameter>[] {
  const several = labels.length > 1
  return [
    {
      key: 'name',
      label: 'Parameter',
      header: true,
      value: (p) => p.name,
      cell: (p) => (
        <span class="parameter-name">
          <BrokenName name={p.name} />
        </span>
      ),
    },
    {
      key: 'unit',
      label: 'Unit',
      minor: true,
      value: (p) => (p.unit === '1' ? '' : p.unit),
      cell: (p) => <span class="nowrap">{p.unit === '1' ? '' : writtenUnit(p.unit)}</span>,
    },
    ...(several
      ? [
          {
            key: 'verdict',
            label: 'Verdict',
            value: rankOf,
            cell: (p: FittedParameter) =>
              p.trust && (
                <span title={p.explanation ?? undefined}>
                  <TrustBadge trust={p.trust} />
                </span>
              ),
          },
        ]
      : []),
    {
      key: 'best',
      label: 'Best',
      numeric: true,
      value: (p) => p.best,
      cell: (p) => <strong>{formatValue(p.best)}</strong>,
    },
    ...LISTED.map(
      (threshold): Column<FittedParameter> => ({
        key: `width ${threshold}`,
        label: `Width ${threshold * 100} %`,
        numeric: true,
        value: (p) => widthAt(identifiability, p, threshold),
        cell: (p) => percent(widthAt(identifiability, p, threshold), 2),
      }),
    ),
    ...(several
      ? labels.map(
          (label, run): Column<FittedParameter> => ({
            key: `run ${run}`,
            label,
            numeric: true,
            value: (p) => p.bests[run],
            cell: (p) => formatValue(p.bests[run]),
          }),
        )
      : []),
    {
      key: 'range',
      label: 'Search range',
      numeric: true,
      cell: searched,
    },
  ]
}

/** Search bounds, or choices. */
function searched({ low, high, choices }: FittedParameter): string {
  if (choices.length > 0) return choices.map(({ name }) => inWords(name)).join(', ')
  return `${formatExact(low, 3)} – ${formatExact(high, 3)}`
}
