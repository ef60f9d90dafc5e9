/** Curves of one or two walks at common times. */

import type { Series } from '../../charts/lines/line-chart'
import type { Recorded } from '../replay/recorded'
import type { Replay } from '../replay/replay'
import type { Curve } from './plot-specs'

/** Dash pattern of the second walk [px]. */
const DASH = [7, 4] as const

/** Times of the longest walk [s]; all have the same rate. */
export function moments(walks: readonly Recorded[]): Float32Array {
  const [longest] = walks.map(({ replay }) => replay).sort((a, b) => b.frames - a.frames)
  return longest.column('time', 0)
}

/** Curves of all walks, those of the second dashed; null after the end of a walk. */
export function seriesOf(curves: readonly Curve[], walks: readonly Recorded[]): Series[] {
  const length = Math.max(...walks.map(({ replay }) => replay.frames))
  return walks.flatMap(({ label, replay }, k) =>
    curves.map((curve) => ({
      label: k === 0 ? curve.label : `${curve.label}, ${label}`,
      values: valuesOf(replay, curve, length),
      colour: curve.colour,
      width: curve.thin ? 1 : 2,
      dash: k === 0 ? undefined : DASH,
    })),
  )
}

function valuesOf(replay: Replay, curve: Curve, length: number): (number | null)[] {
  const values: (number | null)[] = new Array(length).fill(null)
  for (let frame = 0; frame < replay.frames; frame++) {
    const value = replay.value(curve.channel, frame, curve.index)
    if (Number.isFinite(value)) values[frame] = value
  }
  return values
}
