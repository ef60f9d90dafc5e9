/** A surface as a heat map with a movable point and a numeric readout. */

import { useState } from 'preact/hooks'
import { type Box, type Context, drawAxes, remPixels, useCanvas } from '../charts/canvas'
import { ChartCard } from '../charts/chart-card'
import { linearTicks, type Tick } from '../charts/scale'
import { type Column, Table } from '../components/table/table'
import { formatExact, quantity, withUnit } from '../format/number'
import { type Theme, themeColour, useTheme } from '../theme'
import { diverging, gradient } from './colour-map'
import { type Cell, cells, extent, type Layer, layerData, moved, type Universe } from './surface'

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

interface HeatMapProps {
  layer: Layer
  cell: Cell
  onCell: (cell: Cell) => void
}

export function HeatMap({ layer, cell, onCell }: HeatMapProps) {
  const [focused, setFocused] = useState(false)
  const theme = useTheme()
  const { error, current, values, unit, key, limit } = layer
  const draw = (context: Context, width: number) => {
    const area = areaOf(width)
    const x = {
      title: withUnit(error.name, error.unit),
      ticks: ticksOf(error, width < 394 ? 3 : 5),
    }
    const y = { title: withUnit(current.name, current.unit), ticks: ticksOf(current, 4) }
    drawAxes(context, area, remPixels(), x, y)
    drawCells(context, area, layer, theme)
    drawCross(context, area, layer, cell)
  }
  const { canvas } = useCanvas(HEIGHT, draw, [layer, cell], false)
  const point = (event: PointerEvent) => {
    const box = canvas.current!.getBoundingClientRect()
    const area = areaOf(box.width)
    const across = (event.clientX - box.left - area.left) / area.width
    const up = 1 - (event.clientY - box.top - area.top) / area.height
    if (across < 0 || across >= 1 || up < 0 || up >= 1) return
    onCell({
      error: Math.floor(across * error.values.length),
      current: Math.floor(up * current.values.length),
    })
  }
  const press = (event: KeyboardEvent) => {
    const step = STEPS[event.key]
    if (!step) return
    event.preventDefault()
    onCell(moved(cell, ...step, layer))
  }
  const [low, high] = extent(values)
  const value = values[cell.error][cell.current]
  const reading = [
    `error ${quantity(error.values[cell.error], error.unit)}`,
    `current ${quantity(current.values[cell.current], current.unit)}`,
    `${key} ${quantity(value, unit)}`,
  ]
  return (
    <ChartCard
      title={layer.title}
      note={layer.note}
      table={() => <LayerTable layer={layer} />}
      data={() => layerData(layer)}
      legend={
        <div class="colour-legend">
          <span>{quantity(-limit, unit, 3)}</span>
          <i style={{ backgroundImage: gradient(theme) }} aria-hidden="true" />
          <span>{quantity(limit, unit, 3)}</span>
        </div>
      }
    >
      <div
        class="heat-box"
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
          style={{ height: `${HEIGHT}px` }}
          data-layer={key}
          data-min={low}
          data-max={high}
          data-cells={cells(values)}
          data-value={value}
        />
      </div>
      {/* All maps show the same point; only the focused one is announced. */}
      <p class="heat-reading" aria-live={focused ? 'polite' : 'off'}>
        {reading.join(', ')}
      </p>
    </ChartCard>
  )
}

function areaOf(width: number): Box {
  const left = Math.min(68, 0.2 * width)
  return { left, top: 8, width: width - left - 10, height: HEIGHT - 52 }
}

function ticksOf({ range: [low, high], values }: Universe, count: number): Tick[] {
  // Values are at the centres of the cells.
  const half = 0.5 / values.length
  return linearTicks(low, high, count).map((tick) => [
    half + ((tick - low) / (high - low)) * (1 - 2 * half),
    formatExact(tick, 5),
  ])
}

function drawCells(context: Context, area: Box, { values, limit }: Layer, theme: Theme): void {
  const [columns, rows] = [values.length, values[0].length]
  const image = new ImageData(columns, rows)
  for (let i = 0; i < columns; i++) {
    for (let k = 0; k < rows; k++) {
      const colour = diverging(limit > 0 ? values[i][k] / limit : 0, theme)
      image.data.set([...colour, 255], 4 * ((rows - 1 - k) * columns + i))
    }
  }
  const small = new OffscreenCanvas(columns, rows)
  small.getContext('2d')!.putImageData(image, 0, 0)
  context.imageSmoothingEnabled = false
  context.drawImage(small, area.left, area.top, area.width, area.height)
  context.strokeStyle = themeColour('--line-strong')
  context.lineWidth = 1
  context.strokeRect(area.left, area.top, area.width, area.height)
}

function drawCross(context: Context, area: Box, { values }: Layer, cell: Cell): void {
  const [wide, high] = [area.width / values.length, area.height / values[0].length]
  const x = area.left + cell.error * wide
  const y = area.top + area.height - (cell.current + 1) * high
  context.strokeStyle = themeColour('--text')
  context.globalAlpha = 0.55
  context.beginPath()
  context.moveTo(area.left, y + high / 2)
  context.lineTo(area.left + area.width, y + high / 2)
  context.moveTo(x + wide / 2, area.top)
  context.lineTo(x + wide / 2, area.top + area.height)
  context.stroke()
  context.globalAlpha = 1
  context.lineWidth = 2
  context.strokeRect(x - 1, y - 1, wide + 2, high + 2)
}

function LayerTable({ layer }: { layer: Layer }) {
  const { error, current, values, unit } = layer
  const last = current.values.length - 1
  const shown = Array.from({ length: Math.min(TABLE_COLUMNS, last + 1) }, (_, k) =>
    Math.round((k * last) / Math.min(TABLE_COLUMNS - 1, last)),
  )
  const columns: Column<number>[] = [
    { key: 'error', unit: error.unit, digits: 4, header: true, value: (row) => error.values[row] },
    ...shown.map((column) => ({
      key: String(column),
      label: `current ${quantity(current.values[column], current.unit)}`,
      digits: 4,
      value: (row: number) => values[row][column],
    })),
  ]
  return (
    <Table
      caption={`${layer.title} [${unit}] by error and current`}
      columns={columns}
      rows={[...error.values.keys()]}
      pageSize={129}
      tall
    />
  )
}
