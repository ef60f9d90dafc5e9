/** Isolines of the mean rank over the cells of two axes, by marching squares. */

import { CELLS, type Cell } from './pair-model'
import './isolines.css'

/** Position as shares of both axes, from the lower left. */
type Place = readonly [x: number, y: number]

interface Isoline {
  readonly level: number
  readonly pieces: readonly (readonly [from: Place, to: Place])[]
}

interface Corner {
  readonly at: Place
  readonly value: number
}

/**
 * Isolines between the centres of cells, only where four adjacent cells have a mean: nothing is
 * extrapolated.
 */
export function isolinesOf(cells: readonly Cell[], levels: readonly number[]): readonly Isoline[] {
  const grid = new Map<number, Corner>()
  for (const { column, row, bucket } of cells) {
    if (bucket === null) continue
    grid.set(row * CELLS + column, {
      at: [(column + 0.5) / CELLS, (row + 0.5) / CELLS],
      value: bucket,
    })
  }
  const squares = [...grid.keys()].flatMap((key) => {
    if (key % CELLS === CELLS - 1) return []
    const corners = [key, key + 1, key + CELLS + 1, key + CELLS].map((each) => grid.get(each))
    return corners.every((corner) => corner !== undefined) ? [corners as Corner[]] : []
  })
  return levels
    .map((level) => ({ level, pieces: squares.flatMap((square) => piecesIn(square, level)) }))
    .filter(({ pieces }) => pieces.length > 0)
}

/** corners: of one square, in order around it. */
function piecesIn(corners: readonly Corner[], level: number): (readonly [Place, Place])[] {
  const above = corners.map(({ value }) => value >= level)
  const crossed = [0, 1, 2, 3].filter((k) => above[k] !== above[(k + 1) % 4])
  const [a, b, c, d] = crossed.map((k) => crossing(corners[k], corners[(k + 1) % 4], level))
  if (crossed.length < 4) return crossed.length === 2 ? [[a, b]] : []
  // A saddle: the mean decides which two corners are connected.
  const middle = corners.reduce((sum, { value }) => sum + value, 0) / 4
  const together = middle >= level === above[0]
  const [first, second] = together ? [a, c] : [d, b]
  return [
    [first, together ? b : a],
    [second, together ? d : c],
  ]
}

function crossing(from: Corner, to: Corner, level: number): Place {
  const share = (level - from.value) / (to.value - from.value)
  const between = (k: 0 | 1) => from.at[k] + share * (to.at[k] - from.at[k])
  return [between(0), between(1)]
}

/** Size of the view box; the map's width and height are scaled to it. */
const SIDE = 1000

/** Isolines over a map, labelled with their levels, counted from 1. */
export function IsolineLayer({ lines }: { lines: readonly Isoline[] }) {
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
            {level + 1}
          </span>
        )
      })}
    </div>
  )
}

function placed([x, y]: readonly [number, number]): string {
  return `${(SIDE * x).toFixed(1)} ${(SIDE * (1 - y)).toFixed(1)}`
}
