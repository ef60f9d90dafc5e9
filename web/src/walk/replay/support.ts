/** Contact of the feet with the ground: support polygon and slip. */

import { CONTACT_FORCE, type Replay } from './replay'

type Flat = readonly [x: number, y: number, ...rest: number[]]

/** Convex hull, counter-clockwise (Andrew's monotone chain). */
export function hull<P extends Flat>(points: readonly P[]): readonly P[] {
  if (points.length < 3) return points
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1])
  const half = (order: readonly P[]) => {
    const chain: P[] = []
    for (const point of order) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], point) <= 0)
        chain.pop()
      chain.push(point)
    }
    return chain.slice(0, -1)
  }
  return [...half(sorted), ...half(sorted.reverse())]
}

/** Positive for a left turn. */
function turn(a: Flat, b: Flat, c: Flat): number {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/** Speed at which a foot slides on the ground between a frame and the one before it [m/s]. */
export function slipSpeed(replay: Replay, leg: number, frame: number): number {
  const stands = (at: number) => replay.force(at, leg) > CONTACT_FORCE
  if (frame === 0 || !stands(frame) || !stands(frame - 1)) return 0
  const moved = [0, 1].map(
    (axis) =>
      replay.value('foot_position', frame, 3 * leg + axis) -
      replay.value('foot_position', frame - 1, 3 * leg + axis),
  )
  return Math.hypot(...moved) / (replay.time(frame) - replay.time(frame - 1))
}

/** Distance that feet slide, mean of all feet, per distance walked [m/m]; null if it does not advance. */
export function slipPerMetre(replay: Replay): number | null {
  const legs = replay.header.robot.legs.length
  const last = replay.frames - 1
  const walked = Math.hypot(
    ...[0, 1].map((k) => replay.value('link_pose', last, k) - replay.value('link_pose', 0, k)),
  )
  let slid = 0
  for (let frame = 1; frame <= last; frame++) {
    const step = replay.time(frame) - replay.time(frame - 1)
    for (let leg = 0; leg < legs; leg++) slid += slipSpeed(replay, leg, frame) * step
  }
  return walked > 0.01 ? slid / legs / walked : null
}

/** Largest absolute value of a channel over time, and as the largest share of limits by component. */
export function peakOf(replay: Replay, name: string, limits: readonly number[]) {
  const size = replay.channel(name)?.shape.reduce((product, n) => product * n, 1) ?? 0
  let [peak, share] = [0, 0]
  for (let frame = 0; frame < replay.frames; frame++) {
    for (let k = 0; k < size; k++) {
      const value = Math.abs(replay.value(name, frame, k))
      if (value > peak) peak = value
      if (limits[k] > 0 && value / limits[k] > share) share = value / limits[k]
    }
  }
  return size === 0 ? null : { peak, share }
}
