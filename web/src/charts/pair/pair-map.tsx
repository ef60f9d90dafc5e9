/** Designs over two axes of parallel coordinates, as points or as cells by rank; dragging selects. */

import { useEffect, useLayoutEffect, useMemo, useRef, useState } from 'preact/hooks'
import { describeCanvas } from '../../export/canvas-source'
import { themeColour, useTheme } from '../../theme'
import { themePalette } from '../parallel/parallel-coordinates'
import { type Brush, FAILED, type ParallelModel } from '../parallel/parallel-model'
import type { Palette } from '../progressive-painter'
import { IsolineLayer } from './isoline-layer'
import { isolinesOf } from './isolines'
import { PairAxes } from './pair-axes'
import { CELLS, cellsOf, dragged, nearestRow, placeInWords, sampleOf, ticksOf } from './pair-model'
import './pair-map.css'

const HEIGHT_PX = 340
/** Shorter drags count as clicks, as a share of the box. */
const LEAST_STROKE = 0.015
/** Largest distance of a click from a point, as a share of the box. */
const REACH = 0.05
/** Levels of the isolines, as buckets from 0. */
const LEVELS = [1, 3, 5, 7, 9]

type Place = readonly [x: number, y: number]

export function PairMap({
  model,
  rows,
  x,
  y,
  asCells,
  isolines,
  brushes,
  chosen,
  label,
  onSelect,
  onChoose,
}: {
  model: ParallelModel
  /** Selected rows, in the model's order. */
  rows: Uint32Array
  /** Indices of the axes. */
  x: number
  y: number
  /** Show the mean rank by cell instead of points. */
  asCells: boolean
  /** Show lines of equal mean rank. */
  isolines: boolean
  /** Selected ranges of the two axes; null for all. */
  brushes: readonly [Brush | null, Brush | null]
  /** Highlighted row. */
  chosen: number | null
  label: string
  onSelect: (x: Brush, y: Brush) => void
  onChoose: (row: number) => void
}) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const start = useRef<Place | null>(null)
  const [drawn, setDrawn] = useState<readonly [Brush, Brush] | null>(null)
  const [width, setWidth] = useState(0)
  const [under, setUnder] = useState<string | null>(null)
  const theme = useTheme()
  const palette = useMemo(() => themePalette(), [theme])

  useLayoutEffect(() => {
    const observer = new ResizeObserver(() => setWidth(canvas.current!.clientWidth))
    observer.observe(canvas.current!)
    return () => observer.disconnect()
  }, [])

  useEffect(() => {
    if (width === 0) return
    const element = canvas.current!
    element.width = Math.round(width * devicePixelRatio)
    element.height = Math.round(HEIGHT_PX * devicePixelRatio)
    const draw = (on: CanvasRenderingContext2D) => {
      paintGrid(on, model, x, y)
      if (asCells) paintCells(on, model, rows, x, y, palette)
      else paintPoints(on, model, rows, x, y, palette)
      if (chosen !== null)
        paintChosen(on, model.axes[x].places[chosen], model.axes[y].places[chosen])
    }
    draw(element.getContext('2d')!)
    describeCanvas(element, { draw })
  }, [model, rows, x, y, asCells, chosen, palette, width])

  const lines = useMemo(
    () => (isolines ? isolinesOf(cellsOf(model, rows, x, y), LEVELS) : []),
    [model, rows, x, y, isolines],
  )

  const place = (event: PointerEvent): Place => {
    const box = canvas.current!.getBoundingClientRect()
    return [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height]
  }
  const isStroke = (from: Place, to: Place) =>
    Math.max(Math.abs(from[0] - to[0]), Math.abs(from[1] - to[1])) >= LEAST_STROKE
  const end = (event: PointerEvent) => {
    if (start.current === null) return
    const [from, to] = [start.current, place(event)]
    start.current = null
    setDrawn(null)
    if (isStroke(from, to)) onSelect(...dragged(from, to))
    else {
      const row = nearestRow(model, rows, [x, y], to, REACH)
      if (row !== null) onChoose(row)
    }
  }
  const [across, up] = drawn ?? brushes
  const map = (
    <div class="pair-map">
      <canvas
        ref={canvas}
        role="img"
        aria-label={label}
        style={{ height: `${HEIGHT_PX}px` }}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId)
          start.current = place(event)
        }}
        onPointerMove={(event) => {
          const at = place(event)
          if (start.current && isStroke(start.current, at)) setDrawn(dragged(start.current, at))
          setUnder(placeInWords(model, rows, [x, y], at, { asCells, reach: REACH }))
        }}
        onPointerLeave={() => setUnder(null)}
        onPointerUp={end}
        onPointerCancel={() => {
          start.current = null
          setDrawn(null)
        }}
      />
      {isolines && <IsolineLayer lines={lines} words={(level) => String(level + 1)} />}
      {(across || up) && <Selection across={across ?? [0, 1]} up={up ?? [0, 1]} />}
    </div>
  )
  return (
    <div class="pair-chart">
      <PairAxes across={model.axes[x]} up={model.axes[y]}>
        {map}
      </PairAxes>
      <p class="readout" aria-hidden="true">
        {under}
      </p>
    </div>
  )
}

function Selection({ across, up }: { across: Brush; up: Brush }) {
  const share = (part: number) => `${part * 100}%`
  return (
    <span
      class="pair-brush"
      aria-hidden="true"
      style={{
        left: share(across[0]),
        width: share(across[1] - across[0]),
        bottom: share(up[0]),
        height: share(up[1] - up[0]),
      }}
    />
  )
}

function paintGrid(
  context: CanvasRenderingContext2D,
  model: ParallelModel,
  x: number,
  y: number,
): void {
  const { width, height } = context.canvas
  context.fillStyle = themeColour('--grid')
  for (const { place } of ticksOf(model.axes[x])) context.fillRect(place * width, 0, 1, height)
  for (const { place } of ticksOf(model.axes[y]))
    context.fillRect(0, (1 - place) * height, width, 1)
}

function paintPoints(
  context: CanvasRenderingContext2D,
  model: ParallelModel,
  rows: Uint32Array,
  x: number,
  y: number,
  palette: Palette,
): void {
  const { width, height } = context.canvas
  const size = Math.max(2, Math.round(3 * devicePixelRatio))
  const [xs, ys] = [model.axes[x].places, model.axes[y].places]
  const sample = [...sampleOf(rows)]
  // The best are drawn last, on top.
  sample.sort((a, b) => rankOf(model, b) - rankOf(model, a))
  for (const row of sample) {
    const bucket = model.buckets[row]
    context.fillStyle = bucket === FAILED ? palette.failed : palette.buckets[bucket]
    context.fillRect(xs[row] * width - size / 2, (1 - ys[row]) * height - size / 2, size, size)
  }
}

function rankOf(model: ParallelModel, row: number): number {
  return model.buckets[row]
}

function paintCells(
  context: CanvasRenderingContext2D,
  model: ParallelModel,
  rows: Uint32Array,
  x: number,
  y: number,
  palette: Palette,
): void {
  const [width, height] = [context.canvas.width / CELLS, context.canvas.height / CELLS]
  for (const { column, row, bucket } of cellsOf(model, rows, x, y)) {
    context.fillStyle = bucket === null ? palette.failed : palette.buckets[Math.round(bucket)]
    const [left, top] = [column * width, (CELLS - 1 - row) * height]
    context.fillRect(left + 0.5, top + 0.5, width - 1, height - 1)
  }
}

function paintChosen(context: CanvasRenderingContext2D, x: number, y: number): void {
  context.strokeStyle = themeColour('--text')
  context.lineWidth = 2 * devicePixelRatio
  context.beginPath()
  const { width, height } = context.canvas
  context.arc(x * width, (1 - y) * height, 7 * devicePixelRatio, 0, 2 * Math.PI)
  context.stroke()
}
