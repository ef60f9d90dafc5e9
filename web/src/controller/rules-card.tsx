/** Fuzzy rules with their weights and firing strengths at the selected point. */

import { type Column, Table } from '../components/table/table'
import { formatExact } from '../format/number'
import { type Cell, type Output, type Rule, ruleText, type SurfaceView, strength } from './surface'

interface Row {
  readonly number: number
  readonly rule: Rule
  readonly fires: number
}

export function RulesCard({
  surface,
  output,
  cell,
}: {
  surface: SurfaceView
  output: Output
  cell: Cell
}) {
  const rows = output.rules.map(
    (rule, k): Row => ({ number: k + 1, rule, fires: strength(rule, surface, cell) }),
  )
  const columns: Column<Row>[] = [
    { key: 'number', label: 'Rule', numeric: true, header: true, value: (row) => row.number },
    { key: 'text', label: 'Text', cell: (row) => ruleText(row.rule, output.name) },
    {
      key: 'weight',
      label: 'Weight',
      numeric: true,
      value: (row) => row.rule.weight,
      cell: (row) => formatExact(row.rule.weight, 4),
    },
    {
      key: 'fires',
      label: 'Strength',
      numeric: true,
      value: (row) => row.fires,
      cell: (row) => (
        <span class="firing">
          <i class="firing-bar" aria-hidden="true">
            <b style={{ width: `${100 * row.fires}%` }} />
          </i>
          <span>{row.fires.toFixed(3)}</span>
        </span>
      ),
    },
  ]
  return (
    <section class="card" data-rules={rows.length}>
      <header>
        <h2>Rules of {output.name}</h2>
        <p class="muted small">The strength of a rule is its weakest condition times its weight.</p>
      </header>
      <Table
        caption={`Rules of ${output.name}`}
        columns={columns}
        rows={rows}
        rowKey={(row) => String(row.number)}
      />
    </section>
  )
}
