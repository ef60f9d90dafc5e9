/** How steep the ground is: a level line, a plumb line and the angle between ground and level. */

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

/** Of the level line, and of the arc about its end, in spans of the robot. */
const LENGTH = 1.13
const RADIUS = 0.79

/** Of the number of degrees, and how far it is from the arc, in spans. */
const HEIGHT = 0.104
const INSIDE = 0.17

export class SlopeMark {
  /** Stands on the level, so it belongs to the scene, not to the tilted ground. */
  readonly object = new Group()
  private readonly material = new LineBasicMaterial({ depthTest: false })
  /** Where the angle is, from what is looked at [m]. */
  private readonly corner = new Vector3()
  private readonly label = new Sprite(
    new SpriteMaterial({ depthTest: false, transparent: false, alphaTest: 0.4 }),
  )

  constructor(
    private readonly degrees: number,
    /** Up the ground, a unit vector of the scene. */
    uphill: Vector3,
    /** Of the robot [m]. */
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
    // The level lies under the ground: over it, but behind robots.
    for (const part of this.object.children) part.renderOrder = -1
  }

  /** Put the angle there, from what is looked at [m]. */
  placeAt(corner: Vector3): void {
    this.corner.copy(corner)
  }

  /** Stay beside what is looked at. */
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

/** None on level ground. tilt: from the ground's world to the scene. */
export function slopeMark(ground: Ground, tilt: Quaternion, span: number): SlopeMark | null {
  if (ground.slope_deg === 0) return null
  return new SlopeMark(ground.slope_deg, uphill(ground).applyQuaternion(tilt), span)
}

/** Where the mark stands clear of the robots, from what is looked at, in the ground's world [m]; foot: the
 * height of the ground's marks over that. */
export function slopeCorner(ground: Ground, room: number, span: number, foot: number): Vector3 {
  const rises = uphill(ground)
  return new Vector3(-rises.y, rises.x, 0)
    .multiplyScalar(room)
    .addScaledVector(rises, -0.19 * span)
    .setZ(foot)
}

/** Up the ground, in the ground's world. */
function uphill({ slope_deg, slope_direction_deg }: Ground): Vector3 {
  const direction = (slope_direction_deg * Math.PI) / 180
  const rises = new Vector3(Math.cos(direction), Math.sin(direction), 0)
  return slope_deg < 0 ? rises.negate() : rises
}
