/** Plots of a walk over time: one leg, the body, all feet. */

import { useMemo, useRef, useState } from 'preact/hooks'
import { LineCard } from '../../charts/chart-card'
import type { Series } from '../../charts/lines/line-chart'
import { Select } from '../../components/fields/controls'
import { useVisible } from '../../components/use-visible'
import { formatNumber, quantity } from '../../format/number'
import { inWords } from '../../format/words'
import { type Playback, usePlayback } from '../player/playback'
import type { Recorded } from '../replay/replay'
import { ObjectivesTable } from '../walk-result'
import { GaitChart } from './gait-chart'
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
        <ObjectivesTable walks={all} />
        <GaitChart walks={walks} playback={playback} />
        {specs.map((spec) => (
          <PlotCard key={spec.quantity} spec={spec} walks={walks} playback={playback} />
        ))}
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
        marker={time}
        sync="walk"
        onPick={(moment) => playback.seek(moment)}
      />
    </div>
  )
}

interface PlotLegendProps {
  series: readonly Series[]
  /** Number of curves per walk. */
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
