/** Dashed, labelled line across a line chart for a reference fitness. */

import type uPlot from 'uplot'
import { formatNumber } from '../../format/number'
import { themeColour } from '../../theme'
import { chartFont, strokeLine } from '../canvas'

export interface ReferenceLine {
  /** `published A` or `start design`, for example. */
  readonly label: string
  readonly fitness: number
}

export function lineLabel({ label, fitness }: ReferenceLine): string {
  return `${label} ${formatNumber(fitness)}`
}

export function paintReference(plot: uPlot, reference: ReferenceLine): void {
  const { ctx, bbox } = plot
  // On whole pixels, so that the line is sharp.
  const y = Math.round(plot.valToPos(reference.fitness, 'y', true)) + (devicePixelRatio % 2) / 2
  if (y < bbox.top || y > bbox.top + bbox.height) return
  ctx.save()
  ctx.font = chartFont(Math.round(12 * devicePixelRatio))
  ctx.strokeStyle = ctx.fillStyle = themeColour('--text-muted')
  ctx.lineWidth = devicePixelRatio
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio])
  strokeLine(ctx, [bbox.left, y], [bbox.left + bbox.width, y])
  ctx.textAlign = 'right'
  const above = y - bbox.top > 20 * devicePixelRatio
  ctx.textBaseline = above ? 'bottom' : 'top'
  const right = bbox.left + bbox.width - 4 * devicePixelRatio
  ctx.fillText(lineLabel(reference), right, y + (above ? -1 : 4) * devicePixelRatio)
  ctx.restore()
}
