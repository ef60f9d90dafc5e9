/** Draws a matrix as coloured cells with axes on a canvas. */

import { linearTicks } from '../charts/log-axis'
import { formatExact, withUnit } from '../format/number'
import { type Theme, themeColour } from '../theme'
import { diverging } from './colour-map'
import type { Cell, Layer, Universe } from './surface'

/** Area of the cells on the canvas [CSS px]. */
export interface Plot {
  readonly left: number
  readonly top: number
  readonly width: number
  readonly height: number
}

export function plotOf(width: number, height: number): Plot {
  const left = Math.min(64, 0.2 * width)
  return { left, top: 8, width: width - left - 10, height: height - 52 }
}

/** The cell at a position on the canvas; null outside the plot. */
export function cellAt(x: number, y: number, plot: Plot, layer: Layer): Cell | null {
  const across = (x - plot.left) / plot.width
  const up = 1 - (y - plot.top) / plot.height
  if (across < 0 || across >= 1 || up < 0 || up >= 1) return null
  return {
    error: Math.floor(across * layer.error.values.length),
    current: Math.floor(up * layer.current.values.length),
  }
}

/** Draw cells, axes, and a cross through the selected cell. */
export function paint(
  canvas: HTMLCanvasElement,
  width: number,
  height: number,
  layer: Layer,
  cell: Cell,
  theme: Theme,
): void {
  const ratio = devicePixelRatio
  canvas.width = Math.round(width * ratio)
  canvas.height = Math.round(height * ratio)
  canvas.style.width = `${width}px`
  canvas.style.height = `${height}px`
  const context = canvas.getContext('2d')!
  context.setTransform(ratio, 0, 0, ratio, 0, 0)
  const plot = plotOf(width, height)
  paintCells(context, plot, layer, theme)
  paintCross(context, plot, layer, cell)
  paintAxes(context, plot, layer)
}

function paintCells(
  context: CanvasRenderingContext2D,
  plot: Plot,
  { values, error, current, limit }: Layer,
  theme: Theme,
): void {
  const [columns, rows] = [error.values.length, current.values.length]
  const image = new ImageData(columns, rows)
  for (let i = 0; i < columns; i++) {
    for (let k = 0; k < rows; k++) {
      const [r, g, b] = diverging(limit > 0 ? values[i][k] / limit : 0, theme)
      image.data.set([r, g, b, 255], 4 * ((rows - 1 - k) * columns + i))
    }
  }
  const small = new OffscreenCanvas(columns, rows)
  small.getContext('2d')!.putImageData(image, 0, 0)
  context.imageSmoothingEnabled = false
  context.drawImage(small, plot.left, plot.top, plot.width, plot.height)
}

function paintCross(
  context: CanvasRenderingContext2D,
  plot: Plot,
  { error, current }: Layer,
  cell: Cell,
): void {
  const wide = plot.width / error.values.length
  const high = plot.height / current.values.length
  const x = plot.left + cell.error * wide
  const y = plot.top + plot.height - (cell.current + 1) * high
  context.strokeStyle = themeColour('--text')
  context.lineWidth = 1
  context.globalAlpha = 0.55
  context.beginPath()
  context.moveTo(plot.left, y + high / 2)
  context.lineTo(plot.left + plot.width, y + high / 2)
  context.moveTo(x + wide / 2, plot.top)
  context.lineTo(x + wide / 2, plot.top + plot.height)
  context.stroke()
  context.globalAlpha = 1
  context.lineWidth = 2
  context.strokeRect(x - 1, y - 1, wide + 2, high + 2)
}

function paintAxes(context: CanvasRenderingContext2D, plot: Plot, layer: Layer): void {
  const size = 0.857 * Number.parseFloat(getComputedStyle(document.documentElement).fontSize)
  context.font = `${size}px ${getComputedStyle(document.body).fontFamily}`
  context.fillStyle = themeColour('--text-muted')
  context.strokeStyle = themeColour('--line-strong')
  context.lineWidth = 1
  context.strokeRect(plot.left, plot.top, plot.width, plot.height)
  const bottom = plot.top + plot.height
  context.textBaseline = 'top'
  context.textAlign = 'center'
  for (const [share, text] of ticksOf(layer.error, plot.width < 320 ? 3 : 5)) {
    context.fillText(text, plot.left + share * plot.width, bottom + 5)
  }
  const middle = plot.left + plot.width / 2
  context.fillText(withUnit(layer.error.name, layer.error.unit), middle, bottom + 9 + size)
  context.textBaseline = 'middle'
  context.textAlign = 'right'
  for (const [share, text] of ticksOf(layer.current, 4)) {
    context.fillText(text, plot.left - 6, bottom - share * plot.height)
  }
  context.save()
  context.translate(size / 2 + 2, plot.top + plot.height / 2)
  context.rotate(-Math.PI / 2)
  context.textAlign = 'center'
  context.fillText(withUnit(layer.current.name, layer.current.unit), 0, 0)
  context.restore()
}

/** Tick positions as shares of an axis, with labels. */
function ticksOf({ range: [low, high], values }: Universe, count: number): [number, string][] {
  // Values are at the centres of the cells.
  const half = 0.5 / values.length
  return linearTicks(low, high, count).map((tick) => [
    half + ((tick - low) / (high - low)) * (1 - 2 * half),
    formatExact(tick, 5),
  ])
}
