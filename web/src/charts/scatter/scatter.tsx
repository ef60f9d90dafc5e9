/** Scatter chart with labelled marks; a click chooses the nearest point. */

import { useMemo, useState } from 'preact/hooks'
import { formatNumber, withUnit } from '../../format/number'
import { themeColour } from '../../theme'
import {
  type Box,
  type Context,
  chartFont,
  drawAxes,
  remPixels,
  strokeLine,
  useCanvas,
  withAlpha,
} from '../canvas'
import { logRange, nearest, type Scale, shareOf, ticksOf } from '../scale'

export interface Cloud {
  readonly x: ArrayLike<number>
  readonly y: ArrayLike<number>
  readonly colour: `--${string}`
  readonly radius: number
  readonly opacity: number
}

export interface Mark {
  readonly x: number
  readonly y: number
  readonly name: string
  readonly colour: `--${string}`
  readonly shape: 'ring' | 'diamond' | 'square'
}

interface ScatterProps {
  readonly label: string
  readonly xLabel: string
  readonly xUnit: string
  readonly yLabel: string
  readonly yUnit: string
  /** In drawing order; points of the last one can be chosen. */
  readonly clouds: readonly Cloud[]
  readonly marks: readonly Mark[]
  readonly logarithmic: boolean
  readonly chosen: number | null
  readonly onChoose: (index: number) => void
}

/** Height [rem]. */
const HEIGHT = 27.15

/** Largest distance of a click from a point [px]. */
const REACH = 24

type Point = readonly [x: number, y: number]

export function Scatter(props: ScatterProps) {
  const { clouds, marks, logarithmic, chosen, label, xLabel, yLabel, xUnit, yUnit } = props
  const [under, setUnder] = useState<number | null>(null)
  const [x, y] = useMemo(() => {
    const columns = (axis: 'x' | 'y') => [...clouds.map((c) => c[axis]), marks.map((m) => m[axis])]
    return [scaleOf(columns('x'), logarithmic), scaleOf(columns('y'), logarithmic)]
  }, [clouds, marks, logarithmic])
  const em = remPixels()
  const height = Math.round(HEIGHT * em)
  const last = clouds.at(-1)
  const draw = (context: Context, width: number) => {
    const area = areaOf(width, height, em, y)
    const place = placeIn(area, x, y)
    context.lineWidth = 1
    const [across, up] = [withUnit(xLabel, xUnit), withUnit(yLabel, yUnit)]
    drawAxes(
      context,
      area,
      em,
      { title: across, ticks: ticksOf(x) },
      { title: up, ticks: ticksOf(y) },
    )
    for (const cloud of clouds) drawCloud(context, cloud, place)
    drawMarks(context, marks, place, area, em)
    if (last && chosen !== null) {
      context.strokeStyle = themeColour('--text')
      context.lineWidth = 2
      circle(context, place(last.x[chosen], last.y[chosen]), 0.75 * em)
      context.stroke()
    }
  }
  const inputs = [clouds, marks, x, y, chosen, xLabel, yLabel, xUnit, yUnit]
  const { canvas, width } = useCanvas(height, draw, inputs)
  const places = useMemo(() => {
    const place = placeIn(areaOf(width, height, em, y), x, y)
    return Array.from(last?.x ?? [], (at, k) => [k, ...place(at, last!.y[k])] as const)
  }, [last, x, y, width, height])
  const at = (event: MouseEvent) => {
    const { left, top } = canvas.current!.getBoundingClientRect()
    return nearest(places, [event.clientX - left, event.clientY - top], REACH)
  }
  const shown = under !== null && last && under < last.x.length
  return (
    <div class="scatter">
      <canvas
        ref={canvas}
        role="img"
        aria-label={label}
        style={{ height: `${height}px`, cursor: under === null ? 'default' : 'pointer' }}
        onMouseMove={(event) => setUnder(at(event))}
        onMouseLeave={() => setUnder(null)}
        onClick={(event) => {
          const index = at(event)
          if (index !== null) props.onChoose(index)
        }}
      />
      <p class="readout" aria-hidden="true">
        {shown &&
          `${xLabel} ${formatNumber(last.x[under])}  ·  ${yLabel} ${formatNumber(last.y[under])}`}
      </p>
    </div>
  )
}

function areaOf(width: number, height: number, em: number, y: Scale): Box {
  const longest = Math.max(3, ...ticksOf(y).map(([, text]) => text.length))
  const left = Math.ceil(longest * 0.5 * em + 2.2 * em)
  const top = 1.6 * em
  return { left, top, width: width - left - 0.7 * em, height: height - top - 3.2 * em }
}

/** Positions of points in a box [px]. */
function placeIn({ left, top, width, height }: Box, x: Scale, y: Scale) {
  return (px: number, py: number): Point => [
    left + shareOf(x, px) * width,
    top + (1 - shareOf(y, py)) * height,
  ]
}

function circle(context: Context, [x, y]: Point, radius: number): void {
  context.beginPath()
  context.arc(x, y, radius, 0, 2 * Math.PI)
}

type Placing = ReturnType<typeof placeIn>

function drawCloud(context: Context, { x, y, colour, radius, opacity }: Cloud, place: Placing) {
  context.fillStyle = withAlpha(themeColour(colour), opacity)
  for (let k = 0; k < x.length; k++) {
    const at = place(x[k], y[k])
    if (!Number.isFinite(at[0] + at[1])) continue
    circle(context, at, radius)
    context.fill()
  }
}

function drawMarks(
  context: Context,
  marks: readonly Mark[],
  place: Placing,
  area: Box,
  em: number,
): void {
  context.font = chartFont(0.857 * em, '600')
  const size = 0.45 * em
  const names = marks.map(({ x, y, name, colour, shape }) => {
    const [left, top] = place(x, y)
    context.strokeStyle = themeColour(colour)
    context.lineWidth = 2
    if (shape === 'ring') circle(context, [left, top], size)
    else if (shape === 'square') {
      context.beginPath()
      context.rect(left - size, top - size, 2 * size, 2 * size)
    } else {
      const [up, across] = [top - size * 1.3, size * 1.3]
      const right: Point = [left + across, top]
      strokeLine(context, [left, up], right, [left, top + across], [left - across, top], [left, up])
    }
    if (shape !== 'diamond') context.stroke()
    return { at: [left, top] as const, width: context.measureText(name).width }
  })
  context.textAlign = 'left'
  context.textBaseline = 'middle'
  context.lineJoin = 'round'
  for (const [k, at] of placeNames(names, area, em, em).entries()) {
    if (!at) continue
    // An outline keeps labels readable in front of points.
    context.strokeStyle = themeColour('--surface')
    context.lineWidth = 3
    context.strokeText(marks[k].name, ...at)
    context.fillStyle = themeColour(marks[k].colour)
    context.fillText(marks[k].name, ...at)
  }
}

/** Margin before the first and after the last value, as a share of the range. */
const ROOM = 0.05

/** A scale for all finite values; logarithmic only if all are positive. */
export function scaleOf(columns: readonly ArrayLike<number>[], logarithmic: boolean): Scale {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  for (const values of columns) {
    for (let k = 0; k < values.length; k++) {
      if (!Number.isFinite(values[k])) continue
      low = Math.min(low, values[k])
      high = Math.max(high, values[k])
    }
  }
  if (!(low <= high)) return { low: 0, high: 1, logarithmic: false }
  if (logarithmic && low > 0) {
    const [from, to] = logRange(low, high)
    return { low: from, high: to, logarithmic }
  }
  const room = (high - low) * ROOM || Math.abs(high) * ROOM || 1
  return { low: low - room, high: high + room, logarithmic: false }
}

interface Name {
  readonly at: readonly [number, number]
  readonly width: number
}

/**
 * Positions of labels [px], left and middle of each: next to, above or below the point, inside the box
 * and not overlapping earlier labels; null if there is no such position.
 */
export function placeNames(names: readonly Name[], box: Box, height: number, gap: number) {
  const occupied: Box[] = []
  return names.map(({ at: [x, y], width }) => {
    const candidates = [
      [x + gap, y],
      [x - gap - width, y],
      [x - width / 2, y - gap - height / 2],
      [x - width / 2, y + gap + height / 2],
      [x + gap, y - height],
      [x + gap, y + height],
      [x - gap - width, y - height],
      [x - gap - width, y + height],
    ] as const
    const chosen = candidates.find(([left, middle]) => {
      const rect = { left, top: middle - height / 2, width, height }
      if (!isWithin(rect, box) || occupied.some((other) => overlap(rect, other))) return false
      occupied.push(rect)
      return true
    })
    return chosen ?? null
  })
}

function isWithin(rect: Box, box: Box): boolean {
  return (
    rect.left >= box.left &&
    rect.top >= box.top &&
    rect.left + rect.width <= box.left + box.width &&
    rect.top + rect.height <= box.top + box.height
  )
}

function overlap(a: Box, b: Box): boolean {
  return (
    a.left < b.left + b.width &&
    b.left < a.left + a.width &&
    a.top < b.top + b.height &&
    b.top < a.top + a.height
  )
}
