/** Legend of a scene: walks, forces, grid, slope, load. */

import { formatExact } from '../../format/number'
import { lengthInWords } from '../replay/extent'
import type { Recorded } from '../replay/recorded'
import type { SceneOptions } from '../scene/walk-scene'

interface SceneLegendProps {
  walks: readonly Recorded[]
  /** Grid spacing [m], and the force of an arrow of this length [N]. */
  cell: number
  newtons: number
  options: SceneOptions
}

export function SceneLegend({ walks, cell, newtons, options }: SceneLegendProps) {
  const { ground, load_kg } = walks[0].replay.header
  return (
    <div class="legend">
      {walks.map(({ label }, k) => (
        <span key={k}>
          <i class={`swatch walk-${k + 1}`} aria-hidden="true" />
          {label}
          {k > 0 && options.arrangement === 'ghost' ? ' (ghost)' : ''}
        </span>
      ))}
      <span>
        <i class="disc" aria-hidden="true" />
        foot on the ground
      </span>
      {options.forces && (
        <span>
          <i class="arrow" aria-hidden="true" />
          ground reaction force, {lengthInWords(cell)} for {formatExact(newtons)}&nbsp;N
        </span>
      )}
      <span>{lengthInWords(cell)} grid</span>
      {ground.slope_deg !== 0 && (
        <span>
          {formatExact(Math.abs(ground.slope_deg))}° slope,{' '}
          {ground.slope_deg > 0 ? 'rising' : 'falling'} {towards(ground.slope_direction_deg)}
        </span>
      )}
      {load_kg > 0 && <span>{formatExact(load_kg)}&nbsp;kg load</span>}
    </div>
  )
}

function towards(degrees: number): string {
  if (degrees === 0) return 'forward'
  return `${Math.abs(degrees)}° to the ${degrees > 0 ? 'left' : 'right'}`
}
