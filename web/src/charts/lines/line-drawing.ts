/** Redraws a line chart as vector graphics, at the current zoom. */

import type uPlot from 'uplot'
import { withUnit } from '../../format/number'
import { themeColour } from '../../theme'
import { type Context, drawAxes, remPixels, strokeLine, withAlpha } from '../canvas'
import { type Tick, ticksOf } from '../scale'
import type { Band, LineChartProps, Series } from './line-chart'

/** context: in CSS pixels, origin at the upper left corner of the chart's canvas. */
export function drawLines(context: Context, plot: uPlot, props: LineChartProps): void {
  const { xLabel, xUnit = '1', yLabel, yUnit = '1' } = props
  const ratio = devicePixelRatio
  const em = ratio * remPixels()
  context.save()
  // uPlot positions are in device pixels.
  context.scale(1 / ratio, 1 / ratio)
  context.lineWidth = ratio
  const most = Math.min(10, plot.bbox.width / (5 * em))
  const ticks = ticksIn(plot.scales.x, props.xLogarithmic, most).filter(
    ([, text]) => !props.counted || !text.includes('.'),
  )
  const x = { title: withUnit(xLabel, xUnit), ticks }
  const rows = Math.min(8, plot.bbox.height / (2.5 * em))
  const y = {
    title: withUnit(yLabel, yUnit),
    ticks: ticksIn(plot.scales.y, props.logarithmic, rows),
  }
  drawAxes(context, plot.bbox, em, x, y)
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
  strokeLine(context, [x, top], [x, top + height])
  context.restore()
}

function ticksIn(
  { min, max }: uPlot.Scale,
  logarithmic: boolean | undefined,
  count: number,
): Tick[] {
  if (min === undefined || max === undefined) return []
  return ticksOf({ low: min, high: max, logarithmic: logarithmic === true }, Math.max(2, count))
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
