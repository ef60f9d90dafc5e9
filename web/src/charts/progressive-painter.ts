/** Draws many lines over several frames, to keep the page responsive. */

import { BUCKETS, FAILED, type ParallelModel } from './parallel/parallel-model'

export interface Palette {
  readonly buckets: readonly string[]
  readonly failed: string
}

/** Slower frames [ms] shrink the batches, quicker ones enlarge them. */
const SLOW_FRAME_MS = 30
const QUICK_FRAME_MS = 20
const FIRST_PART = 800
const LEAST_PART = 100
const LARGEST_PART = 6000

/** Draw a first batch at once and one per frame afterwards; a new call to `paint` starts over. */
export class ProgressivePainter {
  private readonly context: CanvasRenderingContext2D
  private rows: Uint32Array = new Uint32Array()
  private model: ParallelModel | null = null
  private palette: Palette | null = null
  private drawn = 0
  private part = FIRST_PART
  private frame = 0
  private before = 0

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly progress: (drawn: number, of: number) => void,
  ) {
    // A software canvas: without a GPU, thousands of thin lines are slow on an accelerated one.
    this.context = canvas.getContext('2d', { willReadFrequently: true })!
  }

  paint(model: ParallelModel, rows: Uint32Array, palette: Palette): void {
    this.model = model
    this.rows = rows
    this.palette = palette
    this.drawn = 0
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height)
    cancelAnimationFrame(this.frame)
    this.before = 0
    this.step()
  }

  stop(): void {
    cancelAnimationFrame(this.frame)
  }

  private step(): void {
    const end = Math.min(this.rows.length, this.drawn + this.part)
    this.drawLines(this.rows.subarray(this.drawn, end))
    this.drawn = end
    this.progress(end, this.rows.length)
    if (end === this.rows.length) return
    this.frame = requestAnimationFrame((now) => {
      this.adapt(now)
      this.step()
    })
  }

  private adapt(now: number): void {
    const took = this.before === 0 ? SLOW_FRAME_MS : now - this.before
    this.before = now
    if (took > SLOW_FRAME_MS) this.part = Math.max(LEAST_PART, this.part * 0.6)
    else if (took < QUICK_FRAME_MS) this.part = Math.min(LARGEST_PART, this.part * 1.3)
    this.part = Math.round(this.part)
  }

  /** Draw the worst first, so that the best are on top; one stroke per colour. */
  private drawLines(rows: Uint32Array): void {
    const { axes, buckets } = this.model!
    const { context, canvas, palette } = this
    const groups = new Map<number, number[]>()
    for (const row of rows) {
      const bucket = buckets[row]
      const group = groups.get(bucket)
      if (group) group.push(row)
      else groups.set(bucket, [row])
    }
    const gap = canvas.width / axes.length
    const margin = 3 * devicePixelRatio
    const height = canvas.height - 2 * margin
    context.lineWidth = devicePixelRatio * (this.rows.length > 5000 ? 0.8 : 1)
    context.globalAlpha = opacity(this.rows.length)
    for (const bucket of [FAILED, ...Array(BUCKETS).keys()].sort((a, b) => b - a)) {
      const group = groups.get(bucket)
      if (!group) continue
      context.strokeStyle = bucket === FAILED ? palette!.failed : palette!.buckets[bucket]
      context.beginPath()
      for (const row of group) {
        let pen = false
        for (let a = 0; a < axes.length; a++) {
          const place = axes[a].places[row]
          if (Number.isNaN(place)) {
            pen = false
            continue
          }
          const x = (a + 0.5) * gap
          const y = margin + (1 - place) * height
          if (pen) context.lineTo(x, y)
          else context.moveTo(x, y)
          pen = true
        }
      }
      context.stroke()
    }
  }
}

function opacity(rows: number): number {
  return Math.min(0.85, Math.max(0.06, 18 / Math.sqrt(rows + 1)))
}
