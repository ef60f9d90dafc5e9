/** Draws many lines over several frames, to keep the page responsive. */

import { BUCKETS, FAILED, type ParallelModel } from './parallel/parallel-model'

export interface Palette {
  /** From best to worst. */
  readonly buckets: readonly string[]
  readonly failed: string
}

/** Slower frames [ms] shrink the batches, quicker ones enlarge them. */
const SLOW_FRAME_MS = 30
const QUICK_FRAME_MS = 20
const FIRST_PART = 800
const LEAST_PART = 100
const LARGEST_PART = 6000

/** Draw a first batch of rows at once and one per frame afterwards; returns a function to stop. */
export function paintProgressively(
  canvas: HTMLCanvasElement,
  model: ParallelModel,
  rows: Uint32Array,
  palette: Palette,
): () => void {
  // A software canvas: without a GPU, thousands of thin lines are slow on an accelerated one.
  const context = canvas.getContext('2d', { willReadFrequently: true })!
  context.clearRect(0, 0, canvas.width, canvas.height)
  let [drawn, part, frame, before] = [0, FIRST_PART, 0, 0]
  const step = () => {
    const end = Math.min(rows.length, drawn + part)
    drawLines(context, model, rows.subarray(drawn, end), rows.length, palette)
    drawn = end
    canvas.dataset.drawn = String(end)
    canvas.dataset.rows = String(rows.length)
    if (end === rows.length) return
    frame = requestAnimationFrame((now) => {
      const took = before === 0 ? SLOW_FRAME_MS : now - before
      before = now
      if (took > SLOW_FRAME_MS) part = Math.round(Math.max(LEAST_PART, part * 0.6))
      else if (took < QUICK_FRAME_MS) part = Math.round(Math.min(LARGEST_PART, part * 1.3))
      step()
    })
  }
  step()
  return () => cancelAnimationFrame(frame)
}

/** Draw the worst first, so that the best are on top; one stroke per colour. */
function drawLines(
  context: CanvasRenderingContext2D,
  { axes, buckets }: ParallelModel,
  rows: Uint32Array,
  total: number,
  palette: Palette,
): void {
  const gap = context.canvas.width / axes.length
  const margin = 3 * devicePixelRatio
  const height = context.canvas.height - 2 * margin
  context.lineWidth = devicePixelRatio * (total > 5000 ? 0.8 : 1)
  context.globalAlpha = Math.min(0.85, Math.max(0.06, 18 / Math.sqrt(total + 1)))
  for (const bucket of [FAILED, ...Array(BUCKETS).keys()].sort((a, b) => b - a)) {
    context.strokeStyle = bucket === FAILED ? palette.failed : palette.buckets[bucket]
    context.beginPath()
    for (const row of rows.filter((each) => buckets[each] === bucket)) {
      let pen = false
      for (const [a, { places }] of axes.entries()) {
        const [x, y] = [(a + 0.5) * gap, margin + (1 - places[row]) * height]
        if (pen) context.lineTo(x, y)
        else context.moveTo(x, y)
        pen = !Number.isNaN(y)
      }
    }
    context.stroke()
  }
}
