/** Plots of a walk over time: one leg, the body, all feet. */

import { useMemo, useState } from 'preact/hooks'
import { Select } from '../../components/fields/controls'
import { inWords } from '../../format/words'
import type { Playback } from '../player/playback'
import type { Recorded } from '../replay/recorded'
import { ObjectivesTable } from '../walk-result'
import { GaitChart } from './gait-chart'
import { PlotCard } from './plot-card'
import { plotSpecs } from './plot-specs'

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
          <PlotCard key={spec.key} spec={spec} walks={walks} playback={playback} />
        ))}
      </div>
    </section>
  )
}
