/** Size of the robots in a scene, and scales derived from it. */

import type { Replay, Shape } from './replay'

export interface Extent {
  /** Longest edge of a robot's bounding box at the start [m]. */
  readonly span: number
  /** Lateral edge of that box [m]. */
  readonly width: number
  /** Height of that box above the ground [m]. */
  readonly height: number
  /** Grid spacing, a round number [m]. */
  readonly cell: number
}

/** Span of a scene without anything visible [m]. */
const UNSEEN = 0.5

/** Grid spacing as a share of the span, before rounding. */
const CELL = 0.18

export function extentOf(replays: readonly Replay[]): Extent {
  const edges = [0, 0, 0]
  for (const replay of replays) {
    const [low, high] = boxOf(replay)
    edges[0] = Math.max(edges[0], high[0] - low[0])
    edges[1] = Math.max(edges[1], high[1] - low[1])
    edges[2] = Math.max(edges[2], high[2])
  }
  const span = Math.max(...edges)
  // Nothing visible, or just a point.
  if (!(span > 1e-3 && span < 1e3)) {
    return { span: UNSEEN, width: UNSEEN, height: UNSEEN / 2, cell: roundLength(CELL * UNSEEN) }
  }
  return { span, width: edges[1], height: edges[2], cell: roundLength(CELL * span) }
}

/** The nearest of 1, 2 or 5 times a power of ten, by ratio. */
export function roundLength(length: number): number {
  const power = 10 ** Math.floor(Math.log10(length))
  const steps = [1, 2, 5, 10].map((step) => step * power)
  const off = (step: number) => Math.abs(Math.log(step / length))
  return steps.reduce((best, step) => (off(step) < off(best) ? step : best))
}

/** Readable length: 5 cm, 20 cm, 1 m. */
export function lengthInWords(metres: number): string {
  const centimetres = Math.round(metres * 1e4) / 100
  return centimetres < 100 ? `${centimetres} cm` : `${centimetres / 100} m`
}

/** Bounding box of all links and feet in the first frame [m]. */
function boxOf(replay: Replay): readonly [number[], number[]] {
  const low = [Infinity, Infinity, Infinity]
  const high = [-Infinity, -Infinity, -Infinity]
  const include = (centre: ArrayLike<number>, half: readonly number[]) => {
    for (let i = 0; i < 3; i++) {
      low[i] = Math.min(low[i], centre[i] - half[i])
      high[i] = Math.max(high[i], centre[i] + half[i])
    }
  }
  if (replay.frames === 0) return [low, high]
  const { links, legs } = replay.header.robot
  links.forEach((link, k) => {
    const pose = Array.from({ length: 7 }, (_, i) => replay.value('link_pose', 0, 7 * k + i))
    include(pose, [0, 0, 0])
    for (const shape of link.shapes) {
      // A load is not part of the robot.
      if (shape.role === 'load') continue
      const turned = (vector: readonly number[]) => rotate(pose.slice(3), vector)
      const axes = [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ].map((axis) => turned(rotate(shape.origin.slice(3), axis)))
      const half = halfSizes(shape)
      include(
        turned(shape.origin.slice(0, 3)).map((value, i) => value + pose[i]),
        [0, 1, 2].map((i) => half.reduce((sum, size, n) => sum + size * Math.abs(axes[n][i]), 0)),
      )
    }
  })
  legs.forEach((_, leg) => {
    const foot = [0, 1, 2].map((i) => replay.value('foot_position', 0, 3 * leg + i))
    include(foot, [0, 0, 0])
  })
  return [low, high]
}

/** Rotate a vector by a unit quaternion x y z w. */
function rotate([x, y, z, w]: readonly number[], [a, b, c]: readonly number[]): number[] {
  const [p, q, r] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)]
  return [a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p]
}

/** Half the edges of a solid's bounding box [m]. */
function halfSizes({ type, size }: Shape): readonly number[] {
  switch (type) {
    case 'box':
      return size.map((edge) => edge / 2)
    case 'sphere':
      return [size[0], size[0], size[0]]
    case 'cylinder':
      return [size[0], size[0], size[1] / 2]
    case 'capsule':
      return [size[0], size[0], size[1] / 2 + size[0]]
  }
}

/** Length of the largest arrow, as a share of the robot's span. */
const LONGEST = 0.47

/** Newtons per grid cell, so that forces up to `largest` [N] remain visible. */
export function newtonsPerCell(largest: number, { cell, span }: Extent): number {
  if (!(largest > 0)) return 10
  const needed = (largest * cell) / (LONGEST * span)
  const power = 10 ** Math.floor(Math.log10(needed))
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= needed)!
}

/** The 99th percentile of the values [N], which ignores short impacts. */
export function typicalLargest(norms: Float32Array): number {
  return norms.slice().sort()[Math.floor(norms.length * 0.99)] ?? 0
}
