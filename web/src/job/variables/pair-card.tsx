/** Designs over two of their axes, linked to the selection of the other charts. */

import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { PairMap } from '../../charts/pair/pair-map'
import { CELLS, cellsOf, SAMPLE } from '../../charts/pair/pair-model'
import { type Brushes, withBrush } from '../../charts/parallel/parallel-coordinates'
import type { Axis, ParallelModel } from '../../charts/parallel/parallel-model'
import { valueAt } from '../../charts/parallel/parallel-model'
import { Check } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber } from '../../format/number'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { flag, useQueryValue } from '../../router/query-value'

export function PairCard({
  model,
  selected,
  brushes,
  onBrush,
  chosen,
  onChoose,
}: {
  model: ParallelModel
  selected: Uint32Array
  brushes: Brushes
  onBrush: (brushes: Brushes) => void
  /** Highlighted row; null for none. */
  chosen: number | null
  onChoose: (row: number) => void
}) {
  const { query } = usePlace()
  const index = (name: string | null) => model.axes.findIndex((axis) => axis.name === name)
  const x = Math.max(0, index(query.get('x')))
  const requestedY = index(query.get('y'))
  // Default: fitness over the x axis.
  const y = requestedY >= 0 && requestedY !== x ? requestedY : model.axes.length - 1
  const asCells = query.get('as') === 'ranks'
  const [isolines, setIsolines] = useQueryValue('isolines', flag(false), false)
  const [across, up] = [model.axes[x], model.axes[y]]
  const sampled = selected.length > SAMPLE ? ` A sample of ${formatCount(SAMPLE)} is drawn.` : ''
  return (
    <ChartCard
      title="Two axes"
      note={`Drag to select designs in all charts; click a design to highlight it.${sampled}`}
      tools={
        <>
          <AxisPicker label="Across" axes={model.axes} chosen={x} other={y} name="x" />
          <AxisPicker label="Up" axes={model.axes} chosen={y} other={x} name="y" />
          <label class="check small">
            <input
              type="checkbox"
              checked={asCells}
              onChange={() => setQuery({ as: asCells ? null : 'ranks' })}
            />
            mean rank by cell
          </label>
          <Check label="isolines" checked={isolines} onChange={setIsolines} />
        </>
      }
      legend={
        <>
          <LegendEntry colour="--rank-best" label="best" area />
          <LegendEntry colour="--rank-middle" label="middle" area />
          <LegendEntry colour="--rank-worst" label="worst, by rank of fitness" area />
          {isolines && <span>lines: mean rank by cell, in twelfths</span>}
        </>
      }
      table={() => <CellTable model={model} rows={selected} x={x} y={y} />}
    >
      <PairMap
        model={model}
        rows={selected}
        x={x}
        y={y}
        asCells={asCells}
        isolines={isolines}
        brushes={[brushes.get(x) ?? null, brushes.get(y) ?? null]}
        chosen={chosen}
        label={`${formatCount(selected.length)} designs by ${inWords(across.name)} and ${inWords(up.name)}`}
        onSelect={(a, b) => onBrush(withBrush(withBrush(brushes, x, a), y, b))}
        onChoose={onChoose}
      />
    </ChartCard>
  )
}

function AxisPicker({
  label,
  axes,
  chosen,
  other,
  name,
}: {
  label: string
  axes: readonly Axis[]
  chosen: number
  other: number
  name: 'x' | 'y'
}) {
  return (
    <label class="row small">
      <span>{label}</span>
      <select
        value={axes[chosen].name}
        onChange={(event) => setQuery({ [name]: event.currentTarget.value })}
      >
        {axes.map((axis, k) => (
          <option key={axis.name} value={axis.name} disabled={k === other}>
            {inWords(axis.name)}
          </option>
        ))}
      </select>
    </label>
  )
}

function CellTable({
  model,
  rows,
  x,
  y,
}: {
  model: ParallelModel
  rows: Uint32Array
  x: number
  y: number
}) {
  const cells = cellsOf(model, rows, x, y)
  type Row = (typeof cells)[number]
  const [across, up] = [model.axes[x], model.axes[y]]
  const stretch = (axis: Axis, at: number) =>
    [at, at + 1].map((end) => formatExact(valueAt(axis, end / CELLS), 4)).join(' to ')
  const columns: Column<Row>[] = [
    {
      key: 'x',
      label: inWords(across.name),
      unit: across.unit,
      header: true,
      value: ({ column }) => column,
      data: ({ column }) => stretch(across, column),
      cell: ({ column }) => stretch(across, column),
    },
    {
      key: 'y',
      label: inWords(up.name),
      unit: up.unit,
      value: ({ row }) => row,
      data: ({ row }) => stretch(up, row),
      cell: ({ row }) => stretch(up, row),
    },
    { key: 'designs', label: 'Designs', numeric: true, value: ({ designs }) => designs },
    {
      key: 'rank',
      label: 'Mean rank, in twelfths',
      numeric: true,
      value: ({ bucket }) => bucket,
      data: ({ bucket }) => (bucket === null ? null : bucket + 1),
      cell: ({ bucket }) => formatNumber(bucket === null ? null : bucket + 1, 3),
    },
  ]
  return (
    <Table
      caption="Designs by cell"
      rows={cells}
      rowKey={({ column, row }) => `${column} ${row}`}
      order={{ column: 'rank', descending: false }}
      columns={columns}
      pageSize={20}
    />
  )
}
