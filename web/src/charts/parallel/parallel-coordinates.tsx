/** Parallel coordinates; dragging along an axis selects a range. */

import { useEffect, useMemo, useRef } from 'preact/hooks'
import { BrokenName } from '../../components/text'
import { formatExact, writtenUnit } from '../../format/number'
import { themeColour, useTheme } from '../../theme'
import { useWidth } from '../canvas'
import { type Palette, paintProgressively } from '../progressive-painter'
import { shareOf } from '../scale'
import {
  type Brush,
  BUCKETS,
  marksOf,
  type ParallelModel,
  selectRows,
  stretchOf,
} from './parallel-model'
import './parallel.css'

export type Brushes = ReadonlyMap<number, Brush>

/** Shorter drags, as a share of the axis, count as clicks, which clear the selection. */
const LEAST_STROKE = 0.01
const AXIS_WIDTH_PX = 74
const HEIGHT_PX = 380

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
  return (
    // A scrollable box must be reachable by keyboard.
    <section class="parallel-scroll" tabIndex={0} aria-label={`${label}, by axis`}>
      <div ref={box} style={{ minWidth: `${least}px` }}>
        <div class="parallel-heads">
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
