/** Canvases of charts: size, colours, axes, and redrawing for export. */

import type { RefObject } from 'preact'
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks'
import { themeColour, useTheme } from '../theme'
import type { Tick } from './scale'

export type Context = CanvasRenderingContext2D

/** [px] */
export interface Box {
  readonly left: number
  readonly top: number
  readonly width: number
  readonly height: number
}

interface CanvasSource {
  readonly draw?: (context: Context) => void
  /** Redraw before pixels are read: WebGL discards them after each frame. */
  readonly refresh?: () => void
}

const sources = new WeakMap<HTMLCanvasElement, CanvasSource>()

/** Tell an export how to draw a canvas. */
export function describeCanvas(canvas: HTMLCanvasElement, source: CanvasSource): void {
  sources.set(canvas, source)
}

export function sourceOf(canvas: HTMLCanvasElement): CanvasSource {
  return sources.get(canvas) ?? {}
}

/** Width of an element [CSS px]; 0 before it is laid out. */
export function useWidth(element: RefObject<HTMLElement | null>): number {
  const [width, setWidth] = useState(0)
  useLayoutEffect(() => {
    const observer = new ResizeObserver(() => setWidth(element.current!.clientWidth))
    observer.observe(element.current!)
    return () => observer.disconnect()
  }, [])
  return width
}

/**
 * A canvas as wide as its box, drawn in CSS pixels when its size, the theme or the inputs change.
 * isVector: whether an export can draw it.
 */
export function useCanvas(
  height: number,
  draw: (context: Context, width: number) => void,
  inputs: readonly unknown[],
  isVector = true,
) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const width = useWidth(canvas)
  const theme = useTheme()
  useEffect(() => {
    if (width === 0) return
    const element = canvas.current!
    element.width = Math.round(width * devicePixelRatio)
    element.height = Math.round(height * devicePixelRatio)
    const context = element.getContext('2d')!
    context.scale(devicePixelRatio, devicePixelRatio)
    draw(context, width)
    if (isVector) describeCanvas(element, { draw: (on) => draw(on, width) })
  }, [...inputs, width, height, theme])
  return { canvas, width }
}

export function remPixels(): number {
  return Number.parseFloat(getComputedStyle(document.documentElement).fontSize)
}

/** Font of labels. pixels: size; weight: normal by default. */
export function chartFont(pixels: number, weight = ''): string {
  return `${weight} ${pixels}px ${getComputedStyle(document.body).fontFamily}`.trim()
}

/** Add an opacity to a colour `rgb(...)`. */
export function withAlpha(colour: string, opacity: number): string {
  return colour.replace(/^rgb\((.*)\)$/, (_, channels: string) =>
    channels.includes(',') ? `rgba(${channels}, ${opacity})` : `rgb(${channels} / ${opacity})`,
  )
}

export function strokeLine(context: Context, ...points: readonly (readonly [number, number])[]) {
  context.beginPath()
  for (const [k, [x, y]] of points.entries()) context[k === 0 ? 'moveTo' : 'lineTo'](x, y)
  context.stroke()
}

export interface AxisDrawing {
  readonly title: string
  readonly ticks: readonly Tick[]
}

/** Draw ticks, titles and grid of an area. em: size of the page's font in the context's pixels. */
export function drawAxes(
  context: Context,
  { left, top, width, height }: Box,
  em: number,
  x: AxisDrawing,
  y: AxisDrawing,
): void {
  const [right, bottom] = [left + width, top + height]
  context.font = chartFont(0.857 * em)
  context.fillStyle = themeColour('--text-muted')
  context.strokeStyle = themeColour('--grid')
  context.textAlign = 'center'
  context.textBaseline = 'top'
  let free = Number.NEGATIVE_INFINITY
  for (const [share, text] of x.ticks) {
    const at = left + share * width
    strokeLine(context, [at, top], [at, bottom])
    const half = context.measureText(text).width / 2
    // Labels of a narrow chart would overlap.
    if (at - half < free) continue
    context.fillText(text, at, bottom + 0.35 * em)
    free = at + half + 0.5 * em
  }
  context.fillText(x.title, left + width / 2, bottom + 1.8 * em)
  context.textAlign = 'right'
  context.textBaseline = 'middle'
  for (const [share, text] of y.ticks) {
    const at = bottom - share * height
    strokeLine(context, [left, at], [right, at])
    context.fillText(text, left - 0.45 * em, at)
  }
  context.save()
  context.translate(0.6 * em, top + height / 2)
  context.rotate(-Math.PI / 2)
  context.textAlign = 'center'
  context.fillText(y.title, 0, 0)
  context.restore()
}
