/** Designs over two axes of parallel coordinates, as points or as cells by rank; dragging selects. */

import { useMemo, useRef, useState } from 'preact/hooks'
import { withUnit } from '../../format/number'
import { inWords } from '../../format/words'
import { themeColour, useTheme } from '../../theme'
import { type Context, useCanvas } from '../canvas'
import { themePalette } from '../parallel/parallel-coordinates'
import { type Axis, type Brush, FAILED, type ParallelModel } from '../parallel/parallel-model'
import { IsolineLayer, isolinesOf } from './isolines'
import {
  axisTicks,
  CELLS,
  cellsOf,
  dragged,
  nearestRow,
  placeInWords,
  sampleOf,
} from './pair-model'
import './pair-axes.css'
import './pair-map.css'

const HEIGHT = 340
/** Shorter drags count as clicks, as a share of the box. */
const LEAST_STROKE = 0.015
/** Largest distance of a click from a point, as a share of the box. */
const REACH = 0.05
/** Levels of the isolines, as buckets from 0. */
const LEVELS = [1, 3, 5, 7, 9]
/** Edge of a point [px]. */
const POINT = 3

type Place = readonly [x: number, y: number]

interface PairMapProps {
  model: ParallelModel
  /** Selected rows, in the model's order. */
  rows: Uint32Array
  x: number
  y: number
  asCells: boolean
  isolines: boolean
  /** Selected ranges of the two axes; null for all. */
  brushes: readonly [Brush | null, Brush | null]
  chosen: number | null
  label: string
  onSelect: (x: Brush, y: Brush) => void
  onChoose: (row: number) => void
}

export function PairMap(props: PairMapProps) {
  const { model, rows, x, y, asCells, isolines, brushes, chosen, label } = props
  const start = useRef<Place | null>(null)
  const [drawn, setDrawn] = useState<readonly [Brush, Brush] | null>(null)
  const [under, setUnder] = useState<string | null>(null)
  const theme = useTheme()
  const palette = useMemo(() => themePalette(), [theme])
  const axes = [model.axes[x], model.axes[y]] as const

  const draw = (context: Context, width: number) => {
    context.fillStyle = themeColour('--grid')
    for (const [share] of axisTicks(axes[0])) context.fillRect(share * width, 0, 1, HEIGHT)
    for (const [share] of axisTicks(axes[1])) context.fillRect(0, (1 - share) * HEIGHT, width, 1)
    const colour = (bucket: number) =>
      bucket === FAILED ? palette.failed : palette.buckets[Math.round(bucket)]
    if (asCells) {
      const [wide, high] = [width / CELLS, HEIGHT / CELLS]
      for (const { column, row, bucket } of cellsOf(model, rows, x, y)) {
        context.fillStyle = colour(bucket ?? FAILED)
        const [left, top] = [column * wide, (CELLS - 1 - row) * high]
        context.fillRect(left + 0.5, top + 0.5, wide - 1, high - 1)
      }
    } else {
      // The best are drawn last, on top.
      for (const row of sampleOf(rows).toSorted((a, b) => model.buckets[b] - model.buckets[a])) {
        context.fillStyle = colour(model.buckets[row])
        const [left, top] = [axes[0].places[row] * width, (1 - axes[1].places[row]) * HEIGHT]
        context.fillRect(left - POINT / 2, top - POINT / 2, POINT, POINT)
      }
    }
    if (chosen === null) return
    context.strokeStyle = themeColour('--text')
    context.lineWidth = 2
    context.beginPath()
    const [left, top] = [axes[0].places[chosen] * width, (1 - axes[1].places[chosen]) * HEIGHT]
    context.arc(left, top, 7, 0, 2 * Math.PI)
    context.stroke()
  }
  const { canvas } = useCanvas(HEIGHT, draw, [model, rows, x, y, asCells, chosen, palette])
  const lines = useMemo(
    () => (isolines ? isolinesOf(cellsOf(model, rows, x, y), LEVELS) : []),
    [model, rows, x, y, isolines],
  )

  const placeOf = (event: PointerEvent): Place => {
    const box = canvas.current!.getBoundingClientRect()
    return [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height]
  }
  const isStroke = (from: Place, to: Place) =>
    Math.max(Math.abs(from[0] - to[0]), Math.abs(from[1] - to[1])) >= LEAST_STROKE
  const end = (event: PointerEvent) => {
    if (start.current === null) return
    const [from, to] = [start.current, placeOf(event)]
    start.current = null
    setDrawn(null)
    if (isStroke(from, to)) props.onSelect(...dragged(from, to))
    else {
      const row = nearestRow(model, rows, [x, y], to, REACH)
      if (row !== null) props.onChoose(row)
    }
  }
  const [across, up] = drawn ?? brushes
  return (
    <div class="pair-chart">
      <div class="pair-axes">
        <span class="pair-title">{titleOf(axes[1])}</span>
        <Ticks axis={axes[1]} class="pair-up" side="bottom" />
        <div class="pair-map">
          <canvas
            ref={canvas}
            role="img"
            aria-label={label}
            style={{ height: `${HEIGHT}px` }}
            onPointerDown={(event) => {
              event.currentTarget.setPointerCapture(event.pointerId)
              start.current = placeOf(event)
            }}
            onPointerMove={(event) => {
              const at = placeOf(event)
              if (start.current && isStroke(start.current, at)) {
                setDrawn(dragged(start.current, at))
              }
              setUnder(placeInWords(model, rows, [x, y], at, { asCells, reach: REACH }))
            }}
            onPointerLeave={() => setUnder(null)}
            onPointerUp={end}
            onPointerCancel={() => {
              start.current = null
              setDrawn(null)
            }}
          />
          {isolines && <IsolineLayer lines={lines} />}
          {(across || up) && <Selection across={across ?? [0, 1]} up={up ?? [0, 1]} />}
        </div>
        <Ticks axis={axes[0]} class="pair-across" side="left" />
        <span class="pair-title across">{titleOf(axes[0])}</span>
      </div>
      <p class="readout" aria-hidden="true">
        {under}
      </p>
    </div>
  )
}

function Selection({ across, up }: { across: Brush; up: Brush }) {
  const share = (part: number) => `${part * 100}%`
  const [left, width] = [share(across[0]), share(across[1] - across[0])]
  const [bottom, height] = [share(up[0]), share(up[1] - up[0])]
  return <span class="pair-brush" aria-hidden="true" style={{ left, width, bottom, height }} />
}

function Ticks(props: { axis: Axis; class: string; side: 'left' | 'bottom' }) {
  const ticks = axisTicks(props.axis)
  return (
    <div class={props.class} data-ticks={ticks.length}>
      {ticks.map(([share, text]) => (
        <span key={text} style={{ [props.side]: `${100 * share}%` }}>
          {text}
        </span>
      ))}
    </div>
  )
}

function titleOf({ name, unit }: Axis): string {
  return withUnit(inWords(name), unit)
}
