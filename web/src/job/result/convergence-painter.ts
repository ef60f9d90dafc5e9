/** Draws designs, the reference, marks and a label on the convergence chart. */

import type uPlot from 'uplot'
import { chartFont, withAlpha } from '../../charts/canvas'
import { paintReference, type ReferenceLine } from '../../charts/lines/reference-line'
import { themeColour } from '../../theme'
import type { Dots } from './model'

export interface Painted {
  readonly dots: Dots | null
  readonly reference: ReferenceLine | null
  readonly end: { readonly x: number; readonly y: number; readonly label: string } | null
  readonly above: ReadonlySet<number>
}

export function paintDots(plot: uPlot, { dots }: Painted): void {
  if (dots === null) return
  const { ctx, bbox } = plot
  const size = (dots.fitness.length > 1000 ? 2.5 : 4) * devicePixelRatio
  clipped(plot, () => {
    ctx.fillStyle = withAlpha(themeColour('--series-1'), dots.fitness.length > 1000 ? 0.4 : 0.55)
    for (let row = 0; row < dots.fitness.length; row++) {
      const y = plot.valToPos(dots.fitness[row], 'y', true)
      if (y < bbox.top) continue
      const x = plot.valToPos(dots.iterations[row], 'x', true)
      ctx.beginPath()
      ctx.arc(x, y, size / 2, 0, 2 * Math.PI)
      ctx.fill()
    }
  })
}

export function paintOver(plot: uPlot, painted: Painted): void {
  const { ctx } = plot
  if (painted.reference) paintReference(plot, painted.reference)
  ctx.save()
  ctx.font = chartFont(Math.round(12 * devicePixelRatio))
  paintAbove(plot, painted.above)
  paintEnd(plot, painted.end)
  ctx.restore()
}

/** Draw a small triangle at the upper edge for each iteration. */
function paintAbove(plot: uPlot, above: ReadonlySet<number>): void {
  const { ctx, bbox } = plot
  const size = 4 * devicePixelRatio
  ctx.fillStyle = themeColour('--text-muted')
  for (const iteration of above) {
    const x = plot.valToPos(iteration, 'x', true)
    if (x < bbox.left || x > bbox.left + bbox.width) continue
    ctx.beginPath()
    ctx.moveTo(x - size, bbox.top)
    ctx.lineTo(x + size, bbox.top)
    ctx.lineTo(x, bbox.top - 1.4 * size)
    ctx.closePath()
    ctx.fill()
  }
}

function paintEnd(plot: uPlot, end: Painted['end']): void {
  if (end === null) return
  const { ctx, bbox } = plot
  const x = Math.min(plot.valToPos(end.x, 'x', true), bbox.left + bbox.width)
  const y = plot.valToPos(end.y, 'y', true)
  if (x < bbox.left || y < bbox.top || y > bbox.top + bbox.height) return
  ctx.fillStyle = themeColour('--text')
  ctx.textAlign = 'right'
  // Below the best line, nothing else is drawn.
  const low = bbox.top + bbox.height - y < 20 * devicePixelRatio
  ctx.textBaseline = low ? 'bottom' : 'top'
  ctx.fillText(end.label, x - 2 * devicePixelRatio, y + (low ? -4 : 4) * devicePixelRatio)
}

export function clipped(plot: uPlot, draw: () => void): void {
  const { ctx, bbox } = plot
  ctx.save()
  ctx.beginPath()
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height)
  ctx.clip()
  draw()
  ctx.restore()
}
