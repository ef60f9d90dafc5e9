/** Plots of a walk over time: one leg, the body, all feet. */

import { useCallback, useMemo, useRef, useState } from 'preact/hooks'
import type uPlot from 'uplot'
import { ChartCard, LineCard } from '../../charts/chart-card'
import type { Series } from '../../charts/lines/line-chart'
import { paintReference } from '../../charts/lines/reference-line'
import { linearTicks } from '../../charts/scale'
import { Select } from '../../components/fields/controls'
import { Table } from '../../components/table/table'
import { useVisible } from '../../components/use-visible'
import { formatExact, formatNumber, quantity } from '../../format/number'
import { inWords } from '../../format/words'
import { type Playback, usePlayback } from '../player/playback'
import { type Recorded, stances } from '../replay/replay'
import { WalkFigures } from '../walk-figures'
import { ObjectivesTable } from '../walk-result'
import { moments, type PlotSpec, plotSpecs, seriesOf } from './plot-specs'

/** Update interval of the time marker during playback [ms]. */
const RENEWED = 120

interface WalkPlotsProps {
  /** Walks with frames. */
  walks: readonly Recorded[]
  all: readonly Recorded[]
  playback: Playback
}

export function WalkPlots({ walks, all, playback }: WalkPlotsProps) {
  const [leg, setLeg] = useState(0)
  const [{ replay }] = walks
  const { legs } = replay.header.robot
  const shown = Math.min(leg, legs.length - 1)
  const specs = useMemo(() => plotSpecs(replay, shown), [replay, shown])
  return (
    <section class="stack" aria-label="Charts over time">
      <WalkFigures walks={walks} />
      <div class="row spread">
        <p class="muted small">
          Click a chart to seek, drag to zoom, double-click to reset the zoom.
          {walks.length > 1 && ` Dashed: ${walks[1].label}.`}
        </p>
        <Select
          label="Leg"
          value={String(shown)}
          options={legs.map((name, k) => [String(k), inWords(name)])}
          onChoose={(k) => setLeg(Number(k))}
        />
      </div>
      <div class="grid plots">
        <GaitChart walks={walks} playback={playback} />
        {specs.map((spec) => (
          <PlotCard key={spec.quantity} spec={spec} walks={walks} playback={playback} />
        ))}
        <ObjectivesTable walks={all} />
      </div>
    </section>
  )
}

interface PlotCardProps {
  spec: PlotSpec
  walks: readonly Recorded[]
  playback: Playback
}

export function PlotCard({ spec, walks, playback }: PlotCardProps) {
  const x = useMemo(() => moments(walks), [walks])
  const series = useMemo(() => seriesOf(spec.curves, walks), [spec, walks])
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const { time } = usePlayback(playback, RENEWED, visible)
  const limits = useCallback(
    (plot: uPlot) => {
      for (const { label, value } of spec.limits ?? []) {
        for (const fitness of [value, -value]) paintReference(plot, { label, fitness })
      }
    },
    [spec],
  )
  const frame = Math.max(...walks.map(({ replay }) => replay.frameAt(time)))
  return (
    <div class="plot" ref={box}>
      <LineCard
        title={spec.title}
        note={spec.note}
        caption={`${spec.title} over time`}
        format={(value) => formatNumber(rounded(value))}
        legend={
          <PlotLegend series={series} curves={spec.curves.length} frame={frame} unit={spec.unit} />
        }
        label={`${spec.title} over time`}
        x={x}
        xLabel="time"
        xUnit="s"
        yLabel={spec.quantity}
        yUnit={spec.unit}
        series={series}
        height={220}
        paintOver={limits}
        marker={time}
        sync="walk"
        onPick={(moment) => playback.seek(moment)}
      />
    </div>
  )
}

interface PlotLegendProps {
  series: readonly Series[]
  curves: number
  frame: number
  unit: string
}

/** Legend with the current values, of both walks if there are two. */
function PlotLegend({ series, curves, frame, unit }: PlotLegendProps) {
  return series.slice(0, curves).map(({ label, colour, width, values }, k) => {
    const other = series[k + curves]
    const value = quantity(rounded(values[frame]), other ? '1' : unit, 3)
    return (
      <span key={label}>
        <svg class="stroke" viewBox="0 0 22 6" aria-hidden="true">
          <path d="M0 3H22" style={{ stroke: `var(${colour})`, strokeWidth: width }} />
        </svg>
        {label}
        <b class="value">
          {other ? `${value} | ${quantity(rounded(other.values[frame]), unit, 3)}` : value}
        </b>
      </span>
    )
  })
}

function rounded(value: number | null): number | null {
  return value !== null && Math.abs(value) < 1e-6 ? 0 : value
}

interface GaitRow {
  readonly key: string
  readonly leg: string
  readonly walk: number
  readonly label: string
  readonly spans: readonly (readonly [number, number])[]
  /** Share of the time in stance. */
  readonly share: number
}

/** Stance phases of all feet over time. */
function GaitChart({ walks, playback }: { walks: readonly Recorded[]; playback: Playback }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const { time } = usePlayback(playback, 60, visible)
  const rows = useMemo(() => rowsOf(walks), [walks])
  const end = playback.duration || 1
  const place = (moment: number) => `${(100 * moment) / end}%`
  return (
    <div class="plot" ref={box}>
      <ChartCard
        title="Gait diagram"
        note="Bars show stance phases."
        table={() => <GaitTable rows={rows} comparing={walks.length > 1} />}
      >
        {/* Keyboard users can seek with the replay's slider. */}
        <div
          class="gait"
          role="img"
          aria-label="Stance phases of the feet; the table lists the times"
        >
          {rows.map((row) => (
            <div class="gait-row" key={row.key}>
              <span class="gait-leg">{row.walk === 0 ? row.leg : ''}</span>
              {/* biome-ignore lint/a11y/noStaticElementInteractions: the slider is for keyboards */}
              {/* biome-ignore lint/a11y/useKeyWithClickEvents: the slider is for keyboards */}
              <span
                class="gait-bars"
                onClick={(event) => {
                  const { left, width } = event.currentTarget.getBoundingClientRect()
                  playback.seek(((event.clientX - left) / width) * end)
                }}
              >
                {row.spans.map(([from, to]) => (
                  <i
                    key={from}
                    class={`walk-${row.walk + 1}`}
                    style={{ left: place(from), width: place(to - from) }}
                  />
                ))}
                <b style={{ left: place(time) }} />
              </span>
            </div>
          ))}
          <div class="gait-row">
            <span class="gait-leg">time [s]</span>
            <span class="gait-ticks">
              {linearTicks(0, end, 5).map((tick) => (
                <span key={tick} style={{ left: place(tick) }}>
                  {formatExact(tick, 3)}
                </span>
              ))}
            </span>
          </div>
        </div>
      </ChartCard>
    </div>
  )
}

function GaitTable({ rows, comparing }: { rows: readonly GaitRow[]; comparing: boolean }) {
  const text = (spans: GaitRow['spans']) =>
    spans.map(([from, to]) => `${formatNumber(from, 3)} to ${quantity(to, 's', 3)}`).join('; ')
  return (
    <Table<GaitRow>
      caption="Stance phases"
      rows={rows}
      columns={[
        { key: 'leg', header: true, value: ({ leg }) => leg },
        ...(comparing ? [{ key: 'walk', value: ({ label }: GaitRow) => label }] : []),
        { key: 'duty factor', percent: 3, value: ({ share }) => share },
        {
          key: 'stance phases',
          data: ({ spans }) => spans.map((span) => span.join(' to ')).join('; '),
          cell: ({ spans }) => text(spans),
        },
      ]}
    />
  )
}

/** Legs in the robot's order; walks of the same leg are adjacent. */
function rowsOf(walks: readonly Recorded[]): GaitRow[] {
  const { legs } = walks[0].replay.header.robot
  return legs.flatMap((leg, k) =>
    walks.map(({ replay, label }, walk) => {
      const spans = stances(replay, k)
      const stood = spans.reduce((sum, [from, to]) => sum + to - from, 0)
      const share = replay.end > 0 ? stood / replay.end : 0
      return { key: `${leg} ${walk}`, leg: inWords(leg), walk, label, spans, share }
    }),
  )
}
