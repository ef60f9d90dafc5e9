/** Isolines over a map, labelled with their levels. */

import type { Isoline } from './isolines'
import './isolines.css'

/** Size of the view box; the map's width and height are scaled to it. */
const SIDE = 1000

export function IsolineLayer({
  lines,
  words,
}: {
  lines: readonly Isoline[]
  /** Label of a level. */
  words: (level: number) => string
}) {
  if (lines.length === 0) {
    return (
      <p class="isolines-none small" role="status">
        No isolines: they need four adjacent cells with designs.
      </p>
    )
  }
  return (
    <div class="isolines" aria-hidden="true">
      <svg viewBox={`0 0 ${SIDE} ${SIDE}`} preserveAspectRatio="none" data-isolines={lines.length}>
        {lines.map(({ level, pieces }) => (
          <path
            key={level}
            d={pieces.map(([from, to]) => `M${placed(from)}L${placed(to)}`).join('')}
          />
        ))}
      </svg>
      {lines.map(({ level, pieces }) => {
        const [[x, y]] = pieces[pieces.length >> 1]
        return (
          <span key={level} style={{ left: `${100 * x}%`, bottom: `${100 * y}%` }}>
            {words(level)}
          </span>
        )
      })}
    </div>
  )
}

function placed([x, y]: readonly [number, number]): string {
  return `${(SIDE * x).toFixed(1)} ${(SIDE * (1 - y)).toFixed(1)}`
}
