/** Parallel coordinates; dragging along an axis selects a range. */

import { useEffect, useMemo, useRef } from 'preact/hooks'
import { BrokenName, partsOf } from '../../components/text'
import { formatExact, writtenUnit } from '../../format/number'
import { themeColour, useTheme } from '../../theme'
import { remPixels, useWidth } from '../canvas'
import { shareOf } from '../scale'
import {
  type Brush,
  BUCKETS,
  FAILED,
  marksOf,
  type ParallelModel,
  selectRows,
  stretchOf,
} from './parallel-model'
import './parallel.css'

export type Brushes = ReadonlyMap<number, Brush>

/** Shorter drags, as a share of the axis, count as clicks, which clear the selection. */
const LEAST_STROKE = 0.01
const AXIS_WIDTH_PX = 48
const HEIGHT_PX = 380
/** Mean width of a character of a small heading [rem]. */
const CHARACTER = 0.55
/** Distance between headings [px]. */
const GAP_PX = 6

interface ParallelCoordinatesProps {
  model: ParallelModel
  brushes: Brushes
  onBrush: (brushes: Brushes) => void
  label: string
}

export function ParallelCoordinates({ model, brushes, onBrush, label }: ParallelCoordinatesProps) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const box = useRef<HTMLDivElement>(null)
  const width = useWidth(box)
  const theme = useTheme()
  const palette = useMemo(() => themePalette(), [theme])
  const selected = useMemo(() => selectRows(model, brushes), [model, brushes])

  useEffect(() => {
    if (width === 0) return
    const element = canvas.current!
    const [w, h] = [width, HEIGHT_PX].map((size) => Math.round(size * devicePixelRatio))
    // Setting a size, even the same, allocates the canvas again.
    if (element.width !== w || element.height !== h) Object.assign(element, { width: w, height: h })
    return paintProgressively(element, model, selected, palette)
  }, [model, selected, palette, width])

  const least = model.axes.length * AXIS_WIDTH_PX
  const longest = Math.max(...model.axes.flatMap(({ name }) => partsOf(name).map(lengthOf)))
  const upright =
    width > 0 && width / model.axes.length < longest * CHARACTER * remPixels() + GAP_PX
  return (
    // A scrollable box must be reachable by keyboard.
    <section class="parallel-scroll" tabIndex={0} aria-label={`${label}, by axis`}>
      <div ref={box} style={{ minWidth: `${least}px` }}>
        <div class="parallel-heads" data-upright={upright || undefined}>
          {model.axes.map((axis) => (
            <span key={axis.name} class="small">
              <strong>
                <BrokenName name={axis.name} />
              </strong>
              <span class="unit">{axis.unit === '1' ? '\u00a0' : writtenUnit(axis.unit)}</span>
              <span class="muted">
                <Mark mark={marksOf(axis).at(-1)!} />
              </span>
            </span>
          ))}
        </div>
        <div class="parallel-plot" style={{ height: `${HEIGHT_PX}px` }}>
          <canvas ref={canvas} role="img" aria-label={label} />
          {model.axes.map((axis, index) =>
            // The first and the last choice are labelled below and above the axis.
            axis.choices.slice(1, -1).map((choice, k) => (
              <span
                key={`${axis.name} ${choice}`}
                class="axis-mark small muted"
                style={{
                  left: `${((index + 0.5) / model.axes.length) * 100}%`,
                  bottom: `${shareOf(axis, k + 1) * 100}%`,
                }}
              >
                <Mark mark={choice} />
              </span>
            )),
          )}
          {model.axes.map((axis, index) => (
            <AxisBrush
              key={axis.name}
              left={(index + 0.5) / model.axes.length}
              brush={brushes.get(index) ?? null}
              title={`${axis.name}: ${readBrush(model, index, brushes)}`}
              onBrush={(brush) => onBrush(withBrush(brushes, index, brush))}
            />
          ))}
        </div>
        <div class="parallel-heads">
          {model.axes.map((axis) => (
            <span key={axis.name} class="small muted">
              <Mark mark={marksOf(axis)[0]} />
            </span>
          ))}
        </div>
      </div>
    </section>
  )
}

const lengthOf = (text: string) => text.length

function Mark({ mark }: { mark: number | string }) {
  return <BrokenName name={typeof mark === 'string' ? mark : formatExact(mark, 4)} />
}

/** Replace one brush; null removes it. */
export function withBrush(brushes: Brushes, axis: number, brush: Brush | null): Brushes {
  const changed = new Map(brushes)
  if (brush === null) changed.delete(axis)
  else changed.set(axis, brush)
  return changed
}

interface AxisBrushProps {
  /** Position of the axis as a share of the width. */
  left: number
  brush: Brush | null
  title: string
  onBrush: (brush: Brush | null) => void
}

function AxisBrush({ left, brush, title, onBrush }: AxisBrushProps) {
  const start = useRef<number | null>(null)
  const place = (event: PointerEvent) => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect()
    return Math.min(1, Math.max(0, 1 - (event.clientY - box.top) / box.height))
  }
  const draw = (event: PointerEvent) => {
    if (start.current === null) return
    const [a, b] = [start.current, place(event)].sort((p, q) => p - q)
    onBrush(b - a < LEAST_STROKE ? null : [a, b])
  }
  return (
    <div
      class="axis"
      title={title}
      style={{ left: `${left * 100}%` }}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId)
        start.current = place(event)
      }}
      onPointerMove={draw}
      onPointerUp={(event) => {
        draw(event)
        start.current = null
      }}
      onPointerCancel={() => {
        start.current = null
      }}
    >
      {brush && (
        <span
          class="brush"
          style={{ bottom: `${brush[0] * 100}%`, height: `${(brush[1] - brush[0]) * 100}%` }}
        />
      )}
    </div>
  )
}

function readBrush(model: ParallelModel, index: number, brushes: Brushes): string {
  const brush = brushes.get(index)
  if (!brush) return 'drag along the axis to select'
  return `${stretchOf(model.axes[index], brush)} selected`
}

/** Colours interpolated from best to worst through a middle one. */
export function themePalette(): Palette {
  const stops = ['--rank-best', '--rank-middle', '--rank-worst'] as const
  const [best, middle, worst] = stops.map((name) => channels(themeColour(name)))
  const buckets = Array.from({ length: BUCKETS }, (_, k) => {
    const at = k / (BUCKETS - 1)
    return at < 0.5 ? mixed(best, middle, at * 2) : mixed(middle, worst, at * 2 - 1)
  })
  return { buckets, failed: themeColour('--line-strong') }
}

function channels(colour: string): number[] {
  return (colour.match(/[\d.]+/g) ?? []).slice(0, 3).map(Number)
}

function mixed(a: readonly number[], b: readonly number[], share: number): string {
  return `rgb(${a.map((value, k) => Math.round(value + (b[k] - value) * share)).join(', ')})`
}

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
function paintProgressively(
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
