/** Best fitness for each choice of the categorical parameters. */

import type { FittedParameter } from '../../api/types'
import { BrokenName } from '../../components/broken-name'
import { type Column, Table } from '../../components/table/table'
import { formatNumber } from '../../format/number'
import { inWords } from '../../format/words'

type Choice = FittedParameter['choices'][number]

interface Row {
  readonly parameter: string
  readonly choice: Choice
}

export function ChoicesCard({
  shown,
  labels,
  unit,
}: {
  /** The parameters with choices. */
  shown: readonly FittedParameter[]
  /** Labels of the runs. */
  labels: readonly string[]
  /** Unit of the fitness. */
  unit: string
}) {
  const rows = shown.flatMap(({ name, choices }) =>
    choices.map((choice): Row => ({ parameter: name, choice })),
  )
  return (
    <section class="card" aria-labelledby="choices">
      <header>
        <h2 id="choices">Choices</h2>
        <p class="muted small">
          Best fitness of all designs with each choice. A choice remains possible if any run has it
          among the designs considered as good as its best.
        </p>
      </header>
      <Table
        caption="Best fitness by choice"
        rows={rows}
        rowKey={({ parameter, choice }) => `${parameter} ${choice.name}`}
        columns={columns(labels, unit)}
        rowData={({ parameter, choice }) => ({ 'data-choice': `${parameter} ${choice.name}` })}
        pageSize={60}
      />
    </section>
  )
}

function columns(labels: readonly string[], unit: string): readonly Column<Row>[] {
  const several = labels.length > 1
  return [
    {
      key: 'parameter',
      label: 'Parameter',
      value: ({ parameter }) => parameter,
      cell: ({ parameter }) => <BrokenName name={parameter} />,
    },
    {
      key: 'choice',
      label: 'Choice',
      header: true,
      value: ({ choice }) => choice.name,
      cell: ({ choice }) => inWords(choice.name),
    },
    {
      key: 'fitness',
      label: 'Best fitness',
      unit,
      numeric: true,
      value: ({ choice }) => choice.fitness,
      cell: ({ choice }) => formatNumber(choice.fitness),
    },
    ...(several
      ? labels.map(
          (label, run): Column<Row> => ({
            key: `run ${run}`,
            label,
            unit,
            numeric: true,
            minor: true,
            value: ({ choice }) => choice.by_run[run],
            cell: ({ choice }) => formatNumber(choice.by_run[run]),
          }),
        )
      : []),
    {
      key: 'remains',
      label: 'Possible',
      value: ({ choice }) => (choice.remains ? 'yes' : 'no'),
    },
  ]
}
