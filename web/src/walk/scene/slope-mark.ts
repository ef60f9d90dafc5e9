/** Mark of the ground's slope: horizontal line, plumb line and angle. */

import {
  BufferGeometry,
  Group,
  Line,
  LineBasicMaterial,
  type Quaternion,
  Sprite,
  SpriteMaterial,
  Vector3,
} from 'three'
import type { Replay } from '../replay/replay'
import { proportion, textTexture } from './label'

type Ground = Replay['header']['ground']

/** Length of the horizontal line, and radius of the arc, in spans of the robot. */
const LENGTH = 1.13
const RADIUS = 0.79

/** Height of the angle's label, and its distance from the arc, in spans. */
const HEIGHT = 0.104
const INSIDE = 0.17

export class SlopeMark {
  /** Horizontal, hence part of the scene, not of the tilted ground. */
  readonly object = new Group()
  private readonly material = new LineBasicMaterial({ depthTest: false })
  /** Position of the corner relative to the camera's target [m]. */
  readonly corner = new Vector3()
  private readonly label = new Sprite(
    new SpriteMaterial({ depthTest: false, transparent: false, alphaTest: 0.4 }),
  )

  constructor(
    private readonly degrees: number,
    /** Uphill unit vector in the scene's frame. */
    uphill: Vector3,
    private readonly span: number,
  ) {
    const level = uphill.clone().setZ(0).normalize()
    const angle = (Math.abs(degrees) * Math.PI) / 180
    const direction = (at: number) => level.clone().multiplyScalar(Math.cos(at)).setZ(Math.sin(at))
    const base = level.clone().multiplyScalar(LENGTH * span)
    const top = uphill.clone().multiplyScalar((LENGTH * span) / Math.cos(angle))
    const arc = Array.from({ length: 25 }, (_, k) =>
      direction((k / 24) * angle).multiplyScalar(RADIUS * span),
    )
    this.object.add(this.line([top, new Vector3(), base, top]), this.line(arc))
    this.label.position.copy(direction(angle / 2).multiplyScalar((RADIUS - INSIDE) * span))
    this.object.add(this.label)
    // The horizontal line is below the ground: draw it above, but behind robots.
    for (const part of this.object.children) part.renderOrder = -1
  }

  moveTo(target: Vector3): void {
    this.object.position.addVectors(target, this.corner)
  }

  recolour(colour: string): void {
    this.material.color.setStyle(colour)
    const map = textTexture(`${Math.abs(this.degrees).toFixed(0)}°`, colour)
    const height = HEIGHT * this.span
    this.label.scale.set(height * proportion(map), height, 1)
    this.label.material.map?.dispose()
    this.label.material.map = map
    this.label.material.needsUpdate = true
  }

  private line(points: Vector3[]): Line {
    return new Line(new BufferGeometry().setFromPoints(points), this.material)
  }
}

/** Null on level ground. tilt: rotation from the ground's frame to the scene's. */
export function slopeMark(ground: Ground, tilt: Quaternion, span: number): SlopeMark | null {
  if (ground.slope_deg === 0) return null
  return new SlopeMark(ground.slope_deg, uphill(ground).applyQuaternion(tilt), span)
}

/** Position of the mark clear of the robots, relative to the target, in the ground's frame [m]. */
export function slopeCorner(ground: Ground, room: number, span: number, foot: number): Vector3 {
  const rises = uphill(ground)
  return new Vector3(-rises.y, rises.x, 0)
    .multiplyScalar(room)
    .addScaledVector(rises, -0.19 * span)
    .setZ(foot)
}

/** Uphill direction in the ground's frame. */
function uphill({ slope_deg, slope_direction_deg }: Ground): Vector3 {
  const direction = (slope_direction_deg * Math.PI) / 180
  const rises = new Vector3(Math.cos(direction), Math.sin(direction), 0)
  return slope_deg < 0 ? rises.negate() : rises
}
