/** How large the robots of a scene are, which sets how everything about them is drawn. */

import { multiply, rotate } from './pose'
import type { Replay, Shape } from './replay'

export interface Extent {
  /** Longest edge of the box about a robot where it starts [m]. */
  readonly span: number
  /** Edge of that box to its sides [m]. */
  readonly width: number
  /** Its height over the ground [m]. */
  readonly height: number
  /** Edge of a cell of the ground's grid, a round number [m]. */
  readonly cell: number
}

/** Of a scene without anything to be seen [m]. */
const UNSEEN = 0.5

/** Edge of a cell, as a share of the span, before it is rounded. */
const CELL = 0.18

/** Of the largest robot in every direction. */
export function extentOf(replays: readonly Replay[]): Extent {
  const edges = [0, 0, 0]
  for (const replay of replays) {
    const [low, high] = boxOf(replay)
    edges[0] = Math.max(edges[0], high[0] - low[0])
    edges[1] = Math.max(edges[1], high[1] - low[1])
    edges[2] = Math.max(edges[2], high[2])
  }
  const span = Math.max(...edges)
  // Nothing is drawn, or only a point.
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

/** A length as people read it: 5 cm, 20 cm, 1 m. */
export function lengthInWords(metres: number): string {
  const centimetres = Math.round(metres * 1e4) / 100
  return centimetres < 100 ? `${centimetres} cm` : `${centimetres / 100} m`
}

/** Lowest and highest corner of all links and feet in the first frame [m]. */
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
      // A load is no part of the robot.
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

/** Half the edges of the box about a turned solid, along the world's axes [m]. */
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
