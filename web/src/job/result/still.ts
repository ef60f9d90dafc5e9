/** Lines of a still of a walk: the robot at some moments, and the paths of its feet. */

import { CONTACT_FORCE, type Replay } from '../../walk/replay/replay'
import { hull } from '../../walk/replay/support'

export type Point = readonly [x: number, y: number]
type Place = readonly [x: number, y: number, z: number]

/** Direction of the view: azimuth and elevation [rad]. */
const [AZIMUTH, ELEVATION] = [-0.95, 0.42]

/** Moments at which the robot is drawn, as shares of the walk, with their opacity. */
const MOMENTS = [
  [0.2, 0.18],
  [0.5, 0.3],
  [0.8, 1],
] as const

/** Margin around the drawing [m]. */
const MARGIN = 0.04

/** Orthographic projection; y points down. */
function projected([x, y, z]: Place): Point {
  const [sine, cosine] = [Math.sin(AZIMUTH), Math.cos(AZIMUTH)]
  const depth = x * cosine + y * sine
  return [-x * sine + y * cosine, -(z * Math.cos(ELEVATION) - depth * Math.sin(ELEVATION))]
}

export function stillOf(replay: Replay) {
  const { links, legs } = replay.header.robot
  const place = (channel: string, frame: number, from: number): Place => [
    replay.value(channel, frame, from),
    replay.value(channel, frame, from + 1),
    replay.value(channel, frame, from + 2),
  ]
  const index = new Map(links.map(({ name }, k) => [name, k]))
  const carried = new Set(links.map(({ parent }) => parent))
  /** Links of a leg, from its end to its root. */
  const chains = links
    .filter(({ name, parent }) => parent !== null && !carried.has(name))
    .map(({ name }) => {
      const chain: number[] = []
      for (let at = index.get(name); at; at = index.get(links[at].parent ?? '')) chain.push(at)
      return chain
    })
    .filter((chain) => chain.length > 1)
  const feet = (frame: number) => legs.map((_, k) => place('foot_position', frame, 3 * k))
  const figures = MOMENTS.map(([share, opacity]) => {
    const frame = Math.round(share * (replay.frames - 1))
    const ends = feet(frame)
    const lines = chains.map((chain) => {
      const joints = chain.map((link) => place('link_pose', frame, 7 * link))
      return [nearest(ends, joints[0]), ...joints]
    })
    return {
      opacity,
      legs: lines.map((line) => line.map(projected)),
      body: hull(lines.map((line) => line[line.length - 1])).map(projected),
    }
  })
  const last = Math.round(MOMENTS[MOMENTS.length - 1][0] * (replay.frames - 1))
  const standing = feet(last).filter((_, k) => replay.force(last, k) > CONTACT_FORCE)
  const paths = legs.map((_, k) =>
    Array.from({ length: last + 1 }, (_, frame) => projected(place('foot_position', frame, 3 * k))),
  )
  const points = [...figures.flatMap((figure) => figure.legs.flat()), ...paths.flat()]
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)]
  const [left, top] = [Math.min(...xs) - MARGIN, Math.min(...ys) - MARGIN]
  const size = [Math.max(...xs) + MARGIN - left, Math.max(...ys) + MARGIN - top]
  const box = [left, top, ...size].map((each) => each.toFixed(4)).join(' ')
  return { figures, paths, ground: hull(standing).map(projected), box }
}

function nearest(places: readonly Place[], to: Place): Place {
  const distance = (from: Place) => Math.hypot(...from.map((each, k) => each - to[k]))
  return places.reduce((a, b) => (distance(b) < distance(a) ? b : a))
}
