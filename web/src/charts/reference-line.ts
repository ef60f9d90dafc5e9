/** A dashed line across a chart of lines for what others reached, with its name. */

import type uPlot from 'uplot'
import { formatNumber } from '../format/number'
import { themeColour } from '../theme'

/** Published design that jobs are measured against. */
export interface Published {
  readonly name: string
  readonly fitness: number
}

export function publishedLabel({ name, fitness }: Published): string {
  return `published ${name} ${formatNumber(fitness)}`
}

export function chartFont(): string {
  return `${Math.round(12 * devicePixelRatio)}px ${getComputedStyle(document.body).fontFamily}`
}

/** Nothing where it lies outside of what is shown. */
export function paintPublished(plot: uPlot, published: Published): void {
  const { ctx, bbox } = plot
  const y = plot.valToPos(published.fitness, 'y', true)
  if (y < bbox.top || y > bbox.top + bbox.height) return
  ctx.save()
  ctx.font = chartFont()
  ctx.strokeStyle = ctx.fillStyle = themeColour('--text-muted')
  ctx.lineWidth = devicePixelRatio
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio])
  ctx.beginPath()
  ctx.moveTo(bbox.left, y)
  ctx.lineTo(bbox.left + bbox.width, y)
  ctx.stroke()
  ctx.textAlign = 'right'
  ctx.textBaseline = y - bbox.top > 20 * devicePixelRatio ? 'bottom' : 'top'
  ctx.fillText(publishedLabel(published), bbox.left + bbox.width - 4 * devicePixelRatio, y)
  ctx.restore()
}
