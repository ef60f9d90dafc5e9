/** How a canvas tells what is on it: as lines and words where it can, else as its pixels. */

export interface CanvasSource {
  /** Draws the chart anew in CSS pixels; missing where pixels are all that there is. */
  readonly draw?: (context: CanvasRenderingContext2D) => void
  /** Called before pixels are read: what is drawn by the graphics card is lost after each frame. */
  readonly refresh?: () => void
}

const sources = new WeakMap<HTMLCanvasElement, CanvasSource>()

export function describeCanvas(canvas: HTMLCanvasElement, source: CanvasSource): void {
  sources.set(canvas, source)
}

export function sourceOf(canvas: HTMLCanvasElement): CanvasSource {
  return sources.get(canvas) ?? {}
}
