/** Table of a design's values with their meanings and search bounds. */

import type { Variable } from '../api/types'
import { type Column, Table } from '../components/table/table'
import { formatExact, writtenUnit } from '../format/number'
import { formatExactValue, type Value } from '../format/value'
import { inWords } from '../format/words'
import { ofLegGroups, variablesOf } from '../submission/draft/catalogue'
import type { ResolvedDesign } from '../walk/design/resolve-design'

interface Row {
  readonly variable: Variable
  readonly value: Value
}

export function DesignCard({ design }: { design: ResolvedDesign }) {
  const { controller } = design
  const common = variablesOf(controller)
  const rows = [...common, ...ofLegGroups(common, Object.keys(design.design))]
    .filter(({ name }) => name in design.design)
    .map((variable): Row => ({ variable, value: design.design[variable.name] }))
  const columns: Column<Row>[] = [
    { key: 'name', label: 'Variable', header: true, value: ({ variable }) => variable.name },
    {
      key: 'value',
      label: 'Value',
      numeric: true,
      cell: ({ value }) => formatExactValue(value),
    },
    {
      key: 'unit',
      label: 'Unit',
      cell: ({ variable }) => (variable.unit === '1' ? '' : writtenUnit(variable.unit)),
    },
    {
      key: 'bounds',
      label: 'Search bounds',
      numeric: true,
      minor: true,
      cell: ({ variable }) => searched(variable),
    },
    { key: 'meaning', label: 'Meaning', cell: ({ variable }) => variable.description },
  ]
  return (
    <section class="card" data-design>
      <header>
        <h2>Design</h2>
        <p class="muted small">{controller.description}</p>
      </header>
      <Table
        caption="Design values"
        columns={columns}
        rows={rows}
        rowKey={({ variable }) => variable.name}
      />
    </section>
  )
}

/** Bounds, or choices. */
function searched({ low, high, choices = [] }: Variable): string {
  if (choices.length > 0) return choices.map(inWords).join(', ')
  return `${formatExact(low)} to ${formatExact(high)}`
}
