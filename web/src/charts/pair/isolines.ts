/** Isolines of the mean rank over the cells of two axes, by marching squares. */

import { CELLS, type Cell } from './pair-model'

/** Position as shares of both axes, from the lower left. */
type Place = readonly [x: number, y: number]

/** All segments of one level. */
export interface Isoline {
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
  return together
    ? [
        [a, b],
        [c, d],
      ]
    : [
        [d, a],
        [b, c],
      ]
}

/** Position between two corners at which a level is crossed. */
function crossing(from: Corner, to: Corner, level: number): Place {
  const share = (level - from.value) / (to.value - from.value)
  const between = (k: 0 | 1) => from.at[k] + share * (to.at[k] - from.at[k])
  return [between(0), between(1)]
}
