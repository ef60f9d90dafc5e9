/** Size of the robots in a scene, and scales derived from it. */

import { multiply, rotate } from './pose'
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

/** Extent of the largest robot in every direction. */
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
      const turn = multiply(pose.slice(3), shape.origin.slice(3))
      const at = rotate(pose.slice(3), shape.origin.slice(0, 3))
      include(
        at.map((value, i) => value + pose[i]),
        halfEdges(shape, turn),
      )
    }
  })
  legs.forEach((_, leg) => {
    const foot = [0, 1, 2].map((i) => replay.value('foot_position', 0, 3 * leg + i))
    include(foot, [0, 0, 0])
  })
  return [low, high]
}

/** Half the edges of a rotated solid's bounding box [m]. */
function halfEdges(shape: Shape, turn: readonly number[]): readonly number[] {
  const axes = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ].map((axis) => rotate(turn, axis))
  return [0, 1, 2].map((i) =>
    halfSizes(shape).reduce((sum, half, k) => sum + half * Math.abs(axes[k][i]), 0),
  )
}

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

/** Round numbers of newtons per grid cell. */
const STEPS = [1, 2, 5]

/** Newtons per grid cell, so that forces up to `largest` [N] remain visible. */
export function newtonsPerCell(largest: number, { cell, span }: Extent): number {
  if (!(largest > 0)) return 10
  const needed = (largest * cell) / (LONGEST * span)
  let power = 10 ** Math.floor(Math.log10(needed))
  for (;;) {
    for (const step of STEPS) if (step * power >= needed) return step * power
    power *= 10
  }
}

/** The 99th percentile of the values [N], which ignores short impacts. */
export function typicalLargest(norms: Float32Array): number {
  if (norms.length === 0) return 0
  const sorted = Float32Array.from(norms).sort()
  return sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * 0.99))]
}
