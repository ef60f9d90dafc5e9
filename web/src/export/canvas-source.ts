/** Vector drawing functions of canvases, for export. */

export interface CanvasSource {
  /** Redraw the chart in CSS pixels; missing if only pixels are available. */
  readonly draw?: (context: CanvasRenderingContext2D) => void
  /** Redraw before pixels are read: WebGL discards them after each frame. */
  readonly refresh?: () => void
}

const sources = new WeakMap<HTMLCanvasElement, CanvasSource>()

export function describeCanvas(canvas: HTMLCanvasElement, source: CanvasSource): void {
  sources.set(canvas, source)
}

export function sourceOf(canvas: HTMLCanvasElement): CanvasSource {
  return sources.get(canvas) ?? {}
}
