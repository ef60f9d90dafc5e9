/** What is drawn in a scene, in words: walks, forces, grid, slope, load. */

import { formatExact } from '../../format/number'
import { lengthInWords } from '../replay/extent'
import type { Recorded } from '../replay/recorded'
import type { ViewChoices } from './player-controls'

export function SceneLegend({
  walks,
  cell,
  newtons,
  choices,
}: {
  walks: readonly Recorded[]
  /** Of the grid [m]. */
  cell: number
  newtons: number
  choices: ViewChoices
}) {
  const { ground, load_kg } = walks[0].replay.header
  return (
    <div class="legend">
      {walks.map(({ label }, k) => (
        <span key={k}>
          <i class={`swatch walk-${k + 1}`} aria-hidden="true" />
          {label}
          {k > 0 && choices.arrangement === 'ghost' ? ' (ghost)' : ''}
        </span>
      ))}
      <span>
        <i class="disc" aria-hidden="true" />
        foot on the ground
      </span>
      {choices.forces && (
        <span data-force-scale={newtons}>
          <i class="arrow" aria-hidden="true" />
          force of the ground, {lengthInWords(cell)} for {formatExact(newtons)}&nbsp;N
        </span>
      )}
      <span data-grid={cell}>grid of {lengthInWords(cell)}</span>
      {ground.slope_deg !== 0 && (
        <span data-slope={ground.slope_deg}>
          slope of {formatExact(Math.abs(ground.slope_deg))}°,{' '}
          {ground.slope_deg > 0 ? 'rising' : 'falling'} {towards(ground.slope_direction_deg)}
        </span>
      )}
      {load_kg > 0 && <span data-load={load_kg}>load of {formatExact(load_kg)}&nbsp;kg</span>}
    </div>
  )
}

function towards(degrees: number): string {
  if (degrees === 0) return 'ahead'
  return `${Math.abs(degrees)}° to the ${degrees > 0 ? 'left' : 'right'}`
}
