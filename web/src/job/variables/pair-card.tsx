/** Designs over two of their axes, linked to the selection of the other charts. */

import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { PairMap } from '../../charts/pair/pair-map'
import { CELLS, cellsOf, SAMPLE } from '../../charts/pair/pair-model'
import { type Brushes, withBrush } from '../../charts/parallel/parallel-coordinates'
import type { Axis, ParallelModel } from '../../charts/parallel/parallel-model'
import { valueAt } from '../../charts/scale'
import { Check } from '../../components/fields/controls'
import { Table } from '../../components/table/table'
import { formatCount, formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { flag, useQueryValue } from '../../router/query-value'
import { AxisSelects } from '../axis-select'

type Cell = ReturnType<typeof cellsOf>[number]

function stretch(axis: Axis, at: number): string {
  return [at, at + 1].map((end) => formatExact(valueAt(axis, end / CELLS), 4)).join(' to ')
}

interface PairCardProps {
  model: ParallelModel
  selected: Uint32Array
  brushes: Brushes
  onBrush: (brushes: Brushes) => void
  marked: number | null
  onMark: (row: number) => void
}

export function PairCard({ model, selected, brushes, onBrush, marked, onMark }: PairCardProps) {
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
          <AxisSelects axes={model.axes} x={across.name} y={up.name} onSelect={setQuery} />
          <Check
            label="mean rank by cell"
            checked={asCells}
            onChange={(on) => setQuery({ as: on ? 'ranks' : null })}
          />
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
      table={() => (
        <Table<Cell>
          caption="Designs by cell"
          rows={cellsOf(model, selected, x, y)}
          order={{ column: 'rank', descending: false }}
          columns={[
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
            { key: 'designs', numeric: true, value: ({ designs }) => designs },
            {
              key: 'rank',
              label: 'Mean rank, in twelfths',
              digits: 3,
              value: ({ bucket }) => (bucket === null ? null : bucket + 1),
            },
          ]}
          pageSize={20}
        />
      )}
    >
      <PairMap
        model={model}
        rows={selected}
        x={x}
        y={y}
        asCells={asCells}
        isolines={isolines}
        brushes={[brushes.get(x) ?? null, brushes.get(y) ?? null]}
        chosen={marked}
        label={`${formatCount(selected.length)} designs by ${inWords(across.name)} and ${inWords(up.name)}`}
        onSelect={(a, b) => onBrush(withBrush(withBrush(brushes, x, a), y, b))}
        onChoose={onMark}
      />
    </ChartCard>
  )
}
