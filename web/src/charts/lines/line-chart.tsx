/** Line chart (uPlot) with a readout under the pointer and zoom by dragging. */

import { useEffect, useRef } from 'preact/hooks'
import uPlot from 'uplot'
import 'uplot/dist/uPlot.min.css'
import { formatExact, formatNumber, withUnit } from '../../format/number'
import { RANGE, useQueryValue } from '../../router/query-value'
import { themeColour, useTheme } from '../../theme'
import {
  type Context,
  chartFont,
  describeCanvas,
  drawAxes,
  remPixels,
  strokeLine,
  useWidth,
  withAlpha,
} from '../canvas'
import { logRange, logTicks, type Tick, ticksOf } from '../scale'

export interface Series {
  readonly label: string
  readonly values: ArrayLike<number | null>
  readonly colour: `--${string}`
  /** Line width [px]; 0 draws no line, as for the edges of a band. */
  readonly width?: number
  readonly dash?: readonly number[]
  readonly stepped?: boolean
}

/** The area between two series, given by index. */
export interface Band {
  readonly upper: number
  readonly lower: number
  readonly colour: `--${string}`
  readonly opacity: number
}

export interface LineChartProps {
  readonly label: string
  readonly x: ArrayLike<number>
  readonly xLabel: string
  readonly xUnit?: string
  readonly yLabel: string
  readonly yUnit?: string
  readonly series: readonly Series[]
  readonly bands?: readonly Band[]
  readonly logarithmic?: boolean
  readonly xLogarithmic?: boolean
  readonly counted?: boolean
  /** Margin before the first and after the last x, in the unit of x. */
  readonly xMargin?: number
  readonly fromZero?: boolean
  readonly yRange?: readonly [number, number] | null
  readonly paint?: (plot: uPlot) => void
  readonly paintOver?: (plot: uPlot) => void
  /** Height [px] at the default font size; scales with the font size. */
  readonly height?: number
  /** Position of a vertical line, such as the current time of a replay. */
  readonly marker?: number | null
  readonly onPick?: (x: number) => void
  /** Query parameter of the zoom; charts with the same one zoom together. */
  readonly zoomName?: string
  /** Charts with the same key share their pointer. */
  readonly sync?: string
}

const WHOLE_STEPS = [0, 1, 2, 3, 4, 5, 6].flatMap((power) =>
  [1, 2, 5].map((factor) => factor * 10 ** power),
)

export function LineChart(props: LineChartProps) {
  const box = useRef<HTMLDivElement>(null)
  const readout = useRef<HTMLParagraphElement>(null)
  const plot = useRef<uPlot | null>(null)
  const latest = useRef(props)
  latest.current = props
  const [initial, writeZoom] = useQueryValue(props.zoomName ?? 'zoom', RANGE, null)
  /** Requested range of x. New data must not undo it, even if it reaches beyond them. */
  const zoom = useRef<Zoom>(initial)
  const onZoom = (range: Zoom) => {
    zoom.current = range
    writeZoom(range)
  }
  const theme = useTheme()
  const height = Math.round(((props.height ?? 260) / 14) * remPixels())
  const width = useWidth(box)

  useEffect(() => {
    const drawn = new uPlot(
      { ...options(latest, zoom, onZoom, readout.current!), ...sizeOf(box.current!, height) },
      dataOf(latest.current),
      box.current!,
    )
    plot.current = drawn
    const requested = zoom.current
    if (requested) drawn.setScale('x', { min: requested[0], max: requested[1] })
    // uPlot applies the initial range in a microtask that is already queued; later changes are the
    // user's.
    queueMicrotask(() => {
      drawn.root.dataset.settled = 'true'
    })
    describeCanvas(drawn.ctx.canvas, {
      draw: (context) => drawLines(context, drawn, latest.current),
    })
    return () => {
      drawn.destroy()
      plot.current = null
    }
  }, [theme, height, shapeOf(props)])

  useEffect(() => {
    if (plot.current) renew(plot.current, dataOf(latest.current), zoom.current)
  }, [props.x, props.series, props.yRange?.join()])
  useEffect(() => {
    if (width > 0) plot.current?.setSize(sizeOf(box.current!, height))
  }, [width])
  useEffect(() => plot.current?.redraw(false), [props.marker, props.paint, props.paintOver])

  return (
    <div class="line-chart">
      <div class="chart-box" ref={box} role="img" aria-label={props.label} />
      <p class="readout" ref={readout} aria-hidden="true" />
    </div>
  )
}

function sizeOf({ clientWidth }: HTMLElement, height: number) {
  return { width: Math.max(120, clientWidth), height }
}

type Zoom = readonly [number, number] | null

/** Everything that requires a new plot; other changes are data. */
function shapeOf(props: LineChartProps) {
  const lines = props.series.map((s) => [s.label, s.colour, s.width, s.dash, s.stepped])
  const { bands, logarithmic, xLogarithmic, fromZero, xLabel, yLabel, xUnit, yUnit, yRange } = props
  const axes = [logarithmic, xLogarithmic, fromZero, Boolean(yRange), xLabel, yLabel, xUnit, yUnit]
  return JSON.stringify([lines, bands, axes])
}

function renew(plot: uPlot, data: uPlot.AlignedData, requested: Zoom) {
  const zoom = requested ?? zoomOf(plot)
  if (!zoom) {
    plot.setData(data)
    return
  }
  plot.batch(() => {
    plot.setData(data, false)
    plot.setScale('x', { min: zoom[0], max: zoom[1] })
  })
}

/** Visible range of x; null if it is all of x, or nothing has been drawn yet. */
function zoomOf({ scales, data: [x] }: uPlot): Zoom {
  const { min, max } = scales.x
  if (x.length === 0 || typeof min !== 'number' || typeof max !== 'number') return null
  return min > x[0] || max < x[x.length - 1] ? [min, max] : null
}

function dataOf({ x, series, logarithmic }: LineChartProps): uPlot.AlignedData {
  const columns = series.map(({ values }) =>
    logarithmic ? Array.from(values, (v) => (v !== null && v > 0 ? v : null)) : values,
  )
  return [x, ...columns] as unknown as uPlot.AlignedData
}

/** props: by reference, since callbacks outlive a render. */
function options(
  props: { current: LineChartProps },
  requested: { readonly current: Zoom },
  onZoom: (range: Zoom) => void,
  readout: HTMLElement,
): Omit<uPlot.Options, 'width' | 'height'> {
  const { series, bands = [], logarithmic, sync, counted, xMargin = 0 } = props.current
  const { xLabel, xUnit = '1', xLogarithmic, yLabel, yUnit = '1' } = props.current
  const rem = (size: number) => Math.round(size * remPixels())
  const axis: uPlot.Axis = {
    stroke: themeColour('--text-muted'),
    font: chartFont(rem(0.857)),
    labelFont: chartFont(rem(0.857)),
    grid: { stroke: themeColour('--grid'), width: 1 },
    ticks: { stroke: themeColour('--line'), width: 1, size: 4 },
    gap: 4,
    labelGap: 0,
    labelSize: rem(1.5),
  }
  const logarithmicAxis: Partial<uPlot.Axis> = {
    splits: (_: uPlot, __: number, low: number, high: number) => logTicks(low, high),
    filter: (_: uPlot, splits: number[]) => splits,
  }
  const values = (_: uPlot, splits: number[]) => splits.map((v) => formatExact(v, 5))
  return {
    legend: { show: false },
    padding: [rem(1.4), rem(0.7), 0, 0],
    cursor: {
      points: { size: 6 },
      drag: { x: true, y: false, uni: 20 },
      sync: sync ? { key: sync } : undefined,
    },
    scales: {
      x: xLogarithmic
        ? { time: false, distr: 3, range: (_, low, high) => logRange(low, high) }
        : {
            time: false,
            range: (_, low, high) => [low - xMargin, low === high ? high + 1 : high + xMargin],
          },
      y: scaleOfY(props),
    },
    axes: [
      {
        ...axis,
        label: withUnit(xLabel, xUnit),
        values,
        size: rem(2.2),
        incrs: counted ? WHOLE_STEPS : undefined,
        ...(xLogarithmic && logarithmicAxis),
      },
      {
        ...axis,
        label: withUnit(yLabel, yUnit),
        values,
        size: (_, texts) => axisWidth(texts),
        ...(logarithmic && logarithmicAxis),
      },
    ],
    series: [
      {},
      ...series.map(
        (s): uPlot.Series => ({
          label: s.label,
          stroke: s.width === 0 ? undefined : themeColour(s.colour),
          width: s.width ?? 1.5,
          dash: s.dash ? [...s.dash] : undefined,
          paths: s.stepped ? uPlot.paths.stepped?.({ align: 1 }) : undefined,
          points: { show: s.width === 0 ? false : undefined, size: 4 },
        }),
      ),
    ],
    bands: bands.map((b) => ({
      series: [b.upper + 1, b.lower + 1] as [number, number],
      fill: withAlpha(themeColour(b.colour), b.opacity),
    })),
    hooks: {
      drawAxes: [(u) => props.current.paint?.(u)],
      setCursor: [(u) => showReadout(u, props.current, readout)],
      draw: [
        (u) => props.current.paintOver?.(u),
        (u) => drawMarker(u.ctx, u, props.current.marker ?? null, devicePixelRatio),
      ],
      // Tests read the range from the attribute.
      setScale: [
        (u, key) => {
          const { min, max } = u.scales.x
          if (key !== 'x') return
          u.root.dataset.range = `${min} ${max}`
          const range = zoomOf(u)
          const before = requested.current
          // A requested range may reach beyond the data received so far.
          if (before?.[0] === min && before?.[1] === max) return
          if (!u.root.dataset.settled || range?.join() === before?.join()) return
          onZoom(range)
        },
      ],
      ready: [
        (u) => {
          u.over.addEventListener('click', () => {
            const { left } = u.cursor
            if (left !== undefined && left >= 0) props.current.onPick?.(u.posToVal(left, 'x'))
          })
        },
      ],
    },
  }
}

function scaleOfY(props: { current: LineChartProps }): uPlot.Scale {
  const { logarithmic, fromZero, yRange } = props.current
  if (!logarithmic && !yRange) {
    return fromZero ? { range: (_, __, high) => [0, high > 0 ? high * 1.05 : 1] } : {}
  }
  return {
    distr: logarithmic ? 3 : 1,
    range: (_, low, high) => {
      const { yRange } = props.current
      return yRange ? [...yRange] : logarithmic ? logRange(low, high) : [low, high]
    },
  }
}

function showReadout(u: uPlot, props: LineChartProps, element: HTMLElement) {
  const { idx } = u.cursor
  if (idx === null || idx === undefined) {
    element.textContent = ''
    return
  }
  const unit = (value: string, of = '1') => (of === '1' ? value : `${value}\u00a0${of}`)
  const parts = props.series.map(
    (s) => `${s.label} ${unit(formatNumber(s.values[idx]), props.yUnit)}`,
  )
  const at = unit(formatExact(props.x[idx]), props.xUnit)
  element.textContent = [`${props.xLabel} ${at}`, ...parts].join('  ·  ')
}

/** Space for the longest tick label [px]. */
function axisWidth(texts: string[] | null): number {
  const longest = Math.max(3, ...(texts ?? []).map((text) => text.length))
  return Math.ceil((longest * 0.5 + 0.8) * remPixels())
}

/** Redraw the chart as vector graphics in CSS pixels, at the current zoom. */
function drawLines(context: Context, plot: uPlot, props: LineChartProps): void {
  const { xLabel, xUnit = '1', yLabel, yUnit = '1' } = props
  const ratio = devicePixelRatio
  const em = ratio * remPixels()
  context.save()
  // uPlot positions are in device pixels.
  context.scale(1 / ratio, 1 / ratio)
  context.lineWidth = ratio
  const most = Math.min(10, plot.bbox.width / (5 * em))
  const rows = Math.min(8, plot.bbox.height / (2.5 * em))
  const ticks = ticksIn(plot.scales.x, most)
  const x = props.counted ? ticks.filter(([, text]) => !text.includes('.')) : ticks
  const y = ticksIn(plot.scales.y, rows)
  const [across, up] = [withUnit(xLabel, xUnit), withUnit(yLabel, yUnit)]
  drawAxes(context, plot.bbox, em, { title: across, ticks: x }, { title: up, ticks: y })
  const drawn: uPlot = Object.create(plot, { ctx: { value: context } })
  context.save()
  context.beginPath()
  const { left, top, width, height } = plot.bbox
  context.rect(left, top, width, height)
  context.clip()
  props.paint?.(drawn)
  for (const band of props.bands ?? []) drawBand(context, plot, band)
  for (const [k, series] of props.series.entries()) drawSeries(context, plot, series, k + 1, ratio)
  context.restore()
  // Marks and labels may lie outside the plot area.
  props.paintOver?.(drawn)
  drawMarker(context, plot, props.marker ?? null, ratio)
  context.restore()
}

/** Draw the vertical line at the current time of a replay. */
function drawMarker(context: Context, plot: uPlot, marker: number | null, ratio: number) {
  if (marker === null) return
  const x = plot.valToPos(marker, 'x', true)
  const { left, top, width, height } = plot.bbox
  if (x < left || x > left + width) return
  context.save()
  context.strokeStyle = themeColour('--text')
  context.lineWidth = ratio
  context.setLineDash([])
  strokeLine(context, [x, top], [x, top + height])
  context.restore()
}

function ticksIn({ min, max, distr }: uPlot.Scale, count: number): Tick[] {
  if (min === undefined || max === undefined) return []
  return ticksOf({ low: min, high: max, logarithmic: distr === 3 }, Math.max(2, count))
}

function drawSeries(
  context: Context,
  plot: uPlot,
  { colour, width = 1.5, dash = [], stepped }: Series,
  index: number,
  ratio: number,
): void {
  if (width === 0) return
  const [xs, ys] = [plot.data[0], plot.data[index]]
  context.strokeStyle = themeColour(colour)
  context.lineWidth = width * ratio
  context.setLineDash(dash.map((length) => length * ratio))
  context.beginPath()
  let before: number | null = null
  for (let k = 0; k < xs.length; k++) {
    const value = ys[k]
    if (value === null || value === undefined || Number.isNaN(value)) {
      // Undefined: only another series has this x, so the line continues, as in uPlot.
      if (value !== undefined) before = null
      continue
    }
    const [x, y] = [plot.valToPos(xs[k], 'x', true), plot.valToPos(value, 'y', true)]
    if (before === null) context.moveTo(x, y)
    else {
      if (stepped) context.lineTo(x, before)
      context.lineTo(x, y)
    }
    before = y
  }
  context.stroke()
  context.setLineDash([])
}

function drawBand(context: Context, plot: uPlot, { upper, lower, colour, opacity }: Band): void {
  const [xs, above, below] = [plot.data[0], plot.data[upper + 1], plot.data[lower + 1]]
  const indices = Array.from(xs, (_, k) => k).filter(
    (k) => typeof above[k] === 'number' && typeof below[k] === 'number',
  )
  if (indices.length < 2) return
  const point = (values: ArrayLike<number | null | undefined>) => (k: number) =>
    [plot.valToPos(xs[k], 'x', true), plot.valToPos(values[k]!, 'y', true)] as const
  const outline = [...indices.map(point(above)), ...indices.reverse().map(point(below))]
  context.fillStyle = withAlpha(themeColour(colour), opacity)
  context.beginPath()
  context.moveTo(...outline[0])
  for (const place of outline.slice(1)) context.lineTo(...place)
  context.closePath()
  context.fill()
}
