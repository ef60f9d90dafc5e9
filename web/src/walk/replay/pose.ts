/** Interpolation of poses. A pose is x y z [m] and a unit quaternion x y z w. */

import type { Replay } from './replay'

/** Numbers per pose. */
export const POSE = 7

/** Poses of all links at a time [s], clamped to the walk; written to `out` (7 numbers per link). */
export function samplePoses(replay: Replay, time: number, out: Float32Array): void {
  const channel = replay.channel('link_pose')
  if (!channel || replay.frames === 0) return
  const frame = replay.frameAt(time)
  const next = Math.min(frame + 1, replay.frames - 1)
  const share = shareBetween(replay.time(frame), replay.time(next), time)
  const a = frame * replay.stride + channel.offset
  const b = next * replay.stride + channel.offset
  for (let k = 0; k < out.length; k += POSE) {
    for (let i = k; i < k + 3; i++) {
      out[i] = replay.values[a + i] * (1 - share) + replay.values[b + i] * share
    }
    slerp(replay.values, a + k + 3, b + k + 3, share, out, k + 3)
  }
}

/** Values of a channel at a time [s], linear between frames, clamped to the walk. */
export function sampleChannel(replay: Replay, name: string, time: number, out: Float32Array): void {
  const channel = replay.channel(name)
  if (!channel || replay.frames === 0) return
  const frame = replay.frameAt(time)
  const next = Math.min(frame + 1, replay.frames - 1)
  const share = shareBetween(replay.time(frame), replay.time(next), time)
  const a = frame * replay.stride + channel.offset
  const b = next * replay.stride + channel.offset
  for (let i = 0; i < out.length; i++) {
    out[i] = replay.values[a + i] * (1 - share) + replay.values[b + i] * share
  }
}

/** Spherical interpolation along the shorter arc, from values[a..] to values[b..]. */
export function slerp(
  values: Float32Array,
  a: number,
  b: number,
  share: number,
  out: Float32Array,
  at: number,
): void {
  let cosine = 0
  for (let i = 0; i < 4; i++) cosine += values[a + i] * values[b + i]
  const sign = cosine < 0 ? -1 : 1
  const angle = Math.acos(Math.min(1, Math.abs(cosine)))
  const sine = Math.sin(angle)
  // Nearly equal attitudes: avoid division by zero.
  const [from, to] =
    sine < 1e-4
      ? [1 - share, share]
      : [Math.sin((1 - share) * angle) / sine, Math.sin(share * angle) / sine]
  let norm = 0
  for (let i = 0; i < 4; i++) {
    out[at + i] = from * values[a + i] + sign * to * values[b + i]
    norm += out[at + i] ** 2
  }
  const scale = 1 / Math.sqrt(norm)
  for (let i = 0; i < 4; i++) out[at + i] *= scale
}

function shareBetween(from: number, to: number, time: number): number {
  if (!(to > from)) return 0
  return Math.min(1, Math.max(0, (time - from) / (to - from)))
}

/** Rotate a vector by a unit quaternion x y z w. */
export function rotate(turn: readonly number[], vector: readonly number[]): number[] {
  const [x, y, z, w] = turn
  const [a, b, c] = vector
  const [p, q, r] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)]
  return [a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p]
}

/** Product of unit quaternions x y z w: `second` first, then `first`. */
export function multiply(first: readonly number[], second: readonly number[]): number[] {
  const [x, y, z, w] = first
  const [a, b, c, d] = second
  return [
    w * a + x * d + y * c - z * b,
    w * b - x * c + y * d + z * a,
    w * c + x * b - y * a + z * d,
    w * d - x * a - y * b - z * c,
  ]
}
