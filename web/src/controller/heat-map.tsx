/** A surface as a heat map with a movable point and a numeric readout. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { ChartCard } from '../charts/chart-card'
import { type Column, Table } from '../components/table/table'
import { formatNumber, quantity } from '../format/number'
import { useTheme } from '../theme'
import { gradient } from './colour-map'
import { cellAt, paint, plotOf } from './heat-painter'
import { type Cell, cells, extent, type Layer, layerData, moved } from './surface'

const HEIGHT = 300

/** Number of currents in the table; all of them would be too many columns. */
const TABLE_COLUMNS = 9

const STEPS: Readonly<Record<string, readonly [errors: number, currents: number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
  PageUp: [0, 4],
  PageDown: [0, -4],
  Home: [-8, 0],
  End: [8, 0],
}

export function HeatMap({
  layer,
  cell,
  onCell,
}: {
  layer: Layer
  cell: Cell
  onCell: (cell: Cell) => void
}) {
  const box = useRef<HTMLDivElement>(null)
  const canvas = useRef<HTMLCanvasElement>(null)
  const [focused, setFocused] = useState(false)
  const theme = useTheme()
  useEffect(() => {
    const draw = () => {
      if (!box.current || !canvas.current) return
      paint(canvas.current, box.current.clientWidth, HEIGHT, layer, cell, theme)
    }
    const observer = new ResizeObserver(draw)
    if (box.current) observer.observe(box.current)
    draw()
    return () => observer.disconnect()
  }, [layer, cell, theme])

  const point = (event: PointerEvent) => {
    const { left, top, width } = canvas.current!.getBoundingClientRect()
    const [x, y] = [event.clientX - left, event.clientY - top]
    const hit = cellAt(x, y, plotOf(width, HEIGHT), layer)
    if (hit) onCell(hit)
  }
  const press = (event: KeyboardEvent) => {
    const step = STEPS[event.key]
    if (!step) return
    event.preventDefault()
    onCell(moved(cell, step[0], step[1], layer))
  }
  const [low, high] = extent(layer.values)
  return (
    <ChartCard
      title={layer.title}
      note={layer.note}
      table={() => <LayerTable layer={layer} />}
      data={() => layerData(layer)}
      legend={<ColourLegend layer={layer} />}
    >
      <div
        class="heat-box"
        ref={box}
        tabIndex={0}
        role="application"
        aria-label={`${layer.title} over error and current; arrow keys move the selected point`}
        data-handles-keys
        onPointerDown={point}
        onPointerMove={point}
        onKeyDown={press}
        onFocus={() => setFocused(true)}
        onBlur={() => setFocused(false)}
      >
        <canvas
          ref={canvas}
          data-layer={layer.key}
          data-min={low}
          data-max={high}
          data-cells={cells(layer.values)}
          data-value={layer.values[cell.error][cell.current]}
        />
      </div>
      {/* All maps show the same point; only the focused one is announced. */}
      <p class="heat-reading" aria-live={focused ? 'polite' : 'off'}>
        {reading(layer, cell)}
      </p>
    </ChartCard>
  )
}

/** Values of a cell in words. */
function reading({ error, current, values, unit, key }: Layer, cell: Cell): string {
  const value = values[cell.error][cell.current]
  return [
    `error ${quantity(error.values[cell.error], error.unit)}`,
    `current ${quantity(current.values[cell.current], current.unit)}`,
    `${key} ${quantity(value, unit)}`,
  ].join(', ')
}

function ColourLegend({ layer }: { layer: Layer }) {
  const theme = useTheme()
  return (
    <div class="colour-legend">
      <span>{quantity(-layer.limit, layer.unit, 3)}</span>
      <i style={{ backgroundImage: gradient(theme) }} aria-hidden="true" />
      <span>{quantity(layer.limit, layer.unit, 3)}</span>
    </div>
  )
}

function LayerTable({ layer }: { layer: Layer }) {
  const { error, current, values, unit } = layer
  const last = current.values.length - 1
  const shown = Array.from({ length: Math.min(TABLE_COLUMNS, last + 1) }, (_, k) =>
    Math.round((k * last) / Math.min(TABLE_COLUMNS - 1, last)),
  )
  const columns: Column<number>[] = [
    {
      key: 'error',
      label: 'Error',
      unit: error.unit,
      numeric: true,
      header: true,
      value: (row) => error.values[row],
      cell: (row) => formatNumber(error.values[row]),
    },
    ...shown.map(
      (column): Column<number> => ({
        key: String(column),
        label: `current ${quantity(current.values[column], current.unit)}`,
        numeric: true,
        cell: (row) => formatNumber(values[row][column]),
      }),
    ),
  ]
  return (
    <Table
      caption={`${layer.title} [${unit}] by error and current`}
      columns={columns}
      rows={error.values.map((_, row) => row)}
      rowKey={String}
      pageSize={129}
      tall
    />
  )
}
