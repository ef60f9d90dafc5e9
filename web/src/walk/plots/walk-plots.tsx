/** Plots of a walk over time: one leg, the body, all feet. */

import { useId, useMemo, useState } from 'preact/hooks'
import { inWords } from '../../format/words'
import type { Playback } from '../player/playback'
import type { Recorded } from '../replay/recorded'
import { ObjectivesTable } from '../walk-result'
import { GaitChart } from './gait-chart'
import { PlotCard } from './plot-card'
import { plotSpecs } from './plot-specs'

export function WalkPlots({
  walks,
  all,
  playback,
}: {
  /** Walks with frames. */
  walks: readonly Recorded[]
  all: readonly Recorded[]
  playback: Playback
}) {
  const [leg, setLeg] = useState(0)
  const id = useId()
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
        <div class="row">
          <label for={id} class="label">
            Leg
          </label>
          <select
            id={id}
            value={String(shown)}
            onChange={(event) => setLeg(Number(event.currentTarget.value))}
          >
            {legs.map((name, k) => (
              <option key={name} value={String(k)}>
                {inWords(name)}
              </option>
            ))}
          </select>
        </div>
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
