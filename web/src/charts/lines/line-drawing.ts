/** Redraws a line chart as vector graphics, at the current zoom. */

import type uPlot from 'uplot'
import { formatExact, withUnit } from '../../format/number'
import { themeColour } from '../../theme'
import { linearTicks, logTicks } from '../log-axis'
import type { Band, LineChartProps, Series } from './line-chart'
import { withAlpha } from './line-chart'

type Context = CanvasRenderingContext2D

/** context: in CSS pixels, origin at the upper left corner of the chart's canvas. */
export function drawLines(context: Context, plot: uPlot, props: LineChartProps): void {
  const ratio = devicePixelRatio
  context.save()
  // uPlot positions are in device pixels.
  context.scale(1 / ratio, 1 / ratio)
  drawAxes(context, plot, props, ratio)
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
export function drawMarker(context: Context, plot: uPlot, marker: number | null, ratio: number) {
  if (marker === null) return
  const x = plot.valToPos(marker, 'x', true)
  const { left, top, width, height } = plot.bbox
  if (x < left || x > left + width) return
  context.save()
  context.strokeStyle = themeColour('--text')
  context.lineWidth = ratio
  context.setLineDash([])
  context.beginPath()
  context.moveTo(x, top)
  context.lineTo(x, top + height)
  context.stroke()
  context.restore()
}

function drawAxes(context: Context, plot: uPlot, props: LineChartProps, ratio: number): void {
  const { left, top, width, height } = plot.bbox
  const em = ratio * Number.parseFloat(getComputedStyle(document.documentElement).fontSize)
  const { xLabel, xUnit = '1', yLabel, yUnit = '1', counted, xLogarithmic, logarithmic } = props
  context.font = `${0.857 * em}px ${getComputedStyle(document.body).fontFamily}`
  context.fillStyle = themeColour('--text-muted')
  context.strokeStyle = themeColour('--grid')
  context.lineWidth = ratio
  context.textAlign = 'center'
  context.textBaseline = 'top'
  const line = (x1: number, y1: number, x2: number, y2: number) => {
    context.beginPath()
    context.moveTo(x1, y1)
    context.lineTo(x2, y2)
    context.stroke()
  }
  let free = Number.NEGATIVE_INFINITY
  for (const tick of ticksOf(plot.scales.x, xLogarithmic, Math.min(10, width / (5 * em)))) {
    if (counted && !Number.isInteger(tick)) continue
    const at = plot.valToPos(tick, 'x', true)
    line(at, top, at, top + height)
    const text = formatExact(tick, 5)
    const half = context.measureText(text).width / 2
    // Labels of a narrow chart would overlap.
    if (at - half < free) continue
    context.fillText(text, at, top + height + 0.4 * em)
    free = at + half + 0.5 * em
  }
  context.fillText(withUnit(xLabel, xUnit), left + width / 2, top + height + 2.1 * em)
  context.textAlign = 'right'
  context.textBaseline = 'middle'
  for (const tick of ticksOf(plot.scales.y, logarithmic, Math.min(8, height / (2.5 * em)))) {
    const at = plot.valToPos(tick, 'y', true)
    line(left, at, left + width, at)
    context.fillText(formatExact(tick, 5), left - 0.5 * em, at)
  }
  context.save()
  context.translate(0.7 * em, top + height / 2)
  context.rotate(-Math.PI / 2)
  context.textAlign = 'center'
  context.fillText(withUnit(yLabel, yUnit), 0, 0)
  context.restore()
}

function ticksOf({ min, max }: uPlot.Scale, logarithmic: boolean | undefined, count: number) {
  if (min === undefined || max === undefined || !(max > min)) return []
  return logarithmic ? logTicks(min, max) : linearTicks(min, max, Math.max(2, count))
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
