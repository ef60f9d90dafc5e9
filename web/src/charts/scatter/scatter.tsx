/** Scatter chart with labelled marks; a click chooses the nearest point. */

import { useEffect, useLayoutEffect, useMemo, useRef, useState } from 'preact/hooks'
import { describeCanvas } from '../../export/canvas-source'
import { formatExact, formatNumber, withUnit } from '../../format/number'
import { themeColour, useTheme } from '../../theme'
import { withAlpha } from '../lines/line-chart'
import {
  type Axis,
  axisOf,
  type Box,
  nearest,
  placeIn,
  placeNames,
  type Values,
} from './scatter-model'

export interface Cloud {
  readonly x: Values
  readonly y: Values
  readonly colour: `--${string}`
  /** Radius [px]. */
  readonly radius: number
  readonly opacity: number
}

/** A labelled point. */
export interface Mark {
  readonly x: number
  readonly y: number
  readonly name: string
  readonly colour: `--${string}`
  readonly shape: 'ring' | 'diamond' | 'square'
}

export interface ScatterProps {
  /** Description for screen readers. */
  readonly label: string
  readonly xLabel: string
  readonly xUnit: string
  readonly yLabel: string
  readonly yUnit: string
  /** In drawing order; points of the last one can be chosen. */
  readonly clouds: readonly Cloud[]
  readonly marks: readonly Mark[]
  readonly logarithmic?: boolean
  /** Index in the last cloud. */
  readonly chosen?: number | null
  readonly onChoose?: (index: number) => void
  /** Height [px] at the default font size. */
  readonly height?: number
}

/** Largest distance of a click from a point [px]. */
const REACH = 24

export function Scatter(props: ScatterProps) {
  const box = useRef<HTMLDivElement>(null)
  const canvas = useRef<HTMLCanvasElement>(null)
  const [width, setWidth] = useState(0)
  const [under, setUnder] = useState<number | null>(null)
  const theme = useTheme()
  const { clouds, marks, logarithmic = true, chosen = null } = props
  const { xLabel, yLabel, xUnit, yUnit } = props
  const axes = useMemo(
    () => ({
      x: axisOf([...clouds.map((c) => c.x), marks.map((m) => m.x)], logarithmic),
      y: axisOf([...clouds.map((c) => c.y), marks.map((m) => m.y)], logarithmic),
    }),
    [clouds, marks, logarithmic],
  )
  const em = Number.parseFloat(getComputedStyle(document.documentElement).fontSize)
  const height = Math.round(((props.height ?? 380) / 14) * em)
  const area = areaOf(width, height, em, axes.y)
  const last = clouds.at(-1)
  const places = useMemo(
    () => (last ? Array.from(last.x, (x, k) => placeIn(area, axes.x, axes.y, x, last.y[k])) : []),
    [last, axes, width, height],
  )

  useLayoutEffect(() => {
    const observer = new ResizeObserver(() => setWidth(box.current!.clientWidth))
    observer.observe(box.current!)
    return () => observer.disconnect()
  }, [])

  useEffect(() => {
    const element = canvas.current!
    if (width === 0) return
    element.width = Math.round(width * devicePixelRatio)
    element.height = Math.round(height * devicePixelRatio)
    const context = element.getContext('2d')!
    context.scale(devicePixelRatio, devicePixelRatio)
    const draw = (on: CanvasRenderingContext2D) => {
      const painter = new Painter(on, area, axes.x, axes.y, em)
      painter.frame(withUnit(xLabel, xUnit), withUnit(yLabel, yUnit))
      for (const cloud of clouds) painter.cloud(cloud)
      painter.marks(marks)
      if (chosen !== null && places[chosen]) painter.ring(places[chosen])
    }
    draw(context)
    describeCanvas(element, { draw })
  }, [clouds, marks, axes, chosen, width, height, theme, xLabel, yLabel, xUnit, yUnit])

  const at = (event: MouseEvent) => {
    const { left, top } = canvas.current!.getBoundingClientRect()
    return nearest(places, [event.clientX - left, event.clientY - top], REACH)
  }
  const readout = (index: number) =>
    `${xLabel} ${formatNumber(last!.x[index])}  ·  ${yLabel} ${formatNumber(last!.y[index])}`
  return (
    <div class="scatter" ref={box}>
      <canvas
        ref={canvas}
        role="img"
        aria-label={props.label}
        style={{ height: `${height}px`, cursor: under === null ? 'default' : 'pointer' }}
        onMouseMove={(event) => setUnder(at(event))}
        onMouseLeave={() => setUnder(null)}
        onClick={(event) => {
          const index = at(event)
          if (index !== null) props.onChoose?.(index)
        }}
      />
      <p class="readout" aria-hidden="true">
        {under !== null && last && under < last.x.length && readout(under)}
      </p>
    </div>
  )
}

/** The area between the axes. */
function areaOf(width: number, height: number, em: number, y: Axis): Box {
  const longest = Math.max(3, ...y.ticks.map((tick) => formatExact(tick, 4).length))
  const left = Math.ceil(longest * 0.5 * em + 2.2 * em)
  const top = 1.6 * em
  return { left, top, width: width - left - 0.7 * em, height: height - top - 3.2 * em }
}

class Painter {
  constructor(
    private readonly context: CanvasRenderingContext2D,
    private readonly area: Box,
    private readonly x: Axis,
    private readonly y: Axis,
    private readonly em: number,
  ) {}

  frame(xLabel: string, yLabel: string): void {
    const { context, area, em } = this
    const [bottom, middle] = [area.top + area.height, area.top + area.height / 2]
    context.font = `${0.857 * em}px ${getComputedStyle(document.body).fontFamily}`
    context.fillStyle = themeColour('--text-muted')
    context.strokeStyle = themeColour('--grid')
    context.lineWidth = 1
    context.textBaseline = 'top'
    context.textAlign = 'center'
    let free = Number.NEGATIVE_INFINITY
    for (const tick of this.x.ticks) {
      const [at] = placeIn(area, this.x, this.y, tick, this.y.low)
      this.line(at, area.top, at, bottom)
      const text = formatExact(tick, 4)
      const half = context.measureText(text).width / 2
      // Labels of a narrow chart would overlap.
      if (at - half < free) continue
      context.fillText(text, at, bottom + 0.3 * em)
      free = at + half + 0.5 * em
    }
    context.fillText(xLabel, area.left + area.width / 2, bottom + 1.7 * em)
    context.textBaseline = 'middle'
    context.textAlign = 'right'
    for (const tick of this.y.ticks) {
      const [, at] = placeIn(area, this.x, this.y, this.x.low, tick)
      this.line(area.left, at, area.left + area.width, at)
      context.fillText(formatExact(tick, 4), area.left - 0.4 * em, at)
    }
    context.save()
    context.translate(0.8 * em, middle)
    context.rotate(-Math.PI / 2)
    context.textAlign = 'center'
    context.fillText(yLabel, 0, 0)
    context.restore()
  }

  cloud({ x, y, colour, radius, opacity }: Cloud): void {
    const { context } = this
    context.fillStyle = withAlpha(themeColour(colour), opacity)
    for (let k = 0; k < x.length; k++) {
      const [left, top] = placeIn(this.area, this.x, this.y, x[k], y[k])
      if (!Number.isFinite(left + top)) continue
      context.beginPath()
      context.arc(left, top, radius, 0, 2 * Math.PI)
      context.fill()
    }
  }

  marks(marks: readonly Mark[]): void {
    const { context, em } = this
    const at = marks.map(({ x, y }) => placeIn(this.area, this.x, this.y, x, y))
    context.font = `600 ${0.857 * em}px ${getComputedStyle(document.body).fontFamily}`
    const names = marks.map(({ name }, k) => ({
      at: at[k],
      width: context.measureText(name).width,
    }))
    for (const [k, { colour, shape }] of marks.entries()) {
      context.strokeStyle = themeColour(colour)
      context.lineWidth = 2
      context.beginPath()
      const [left, top] = at[k]
      const size = 0.45 * em
      if (shape === 'ring') context.arc(left, top, size, 0, 2 * Math.PI)
      else if (shape === 'square') context.rect(left - size, top - size, 2 * size, 2 * size)
      else {
        context.moveTo(left, top - size * 1.3)
        context.lineTo(left + size * 1.3, top)
        context.lineTo(left, top + size * 1.3)
        context.lineTo(left - size * 1.3, top)
        context.closePath()
      }
      context.stroke()
    }
    context.textAlign = 'left'
    context.textBaseline = 'middle'
    context.lineJoin = 'round'
    for (const [k, place] of placeNames(names, this.area, em, em).entries()) {
      if (!place) continue
      // An outline keeps labels readable in front of points.
      context.strokeStyle = themeColour('--surface')
      context.lineWidth = 3
      context.strokeText(marks[k].name, ...place)
      context.fillStyle = themeColour(marks[k].colour)
      context.fillText(marks[k].name, ...place)
    }
  }

  /** Mark the chosen point. */
  ring([left, top]: readonly [number, number]): void {
    const { context, em } = this
    context.strokeStyle = themeColour('--text')
    context.lineWidth = 2
    context.beginPath()
    context.arc(left, top, 0.75 * em, 0, 2 * Math.PI)
    context.stroke()
  }

  private line(x1: number, y1: number, x2: number, y2: number): void {
    this.context.beginPath()
    this.context.moveTo(x1, y1)
    this.context.lineTo(x2, y2)
    this.context.stroke()
  }
}
