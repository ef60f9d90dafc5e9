/** Marks of foot contacts with force arrows. */

import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from 'three'
import { CONTACT_FORCE, type Replay } from '../replay/replay'
import { hull } from '../replay/support'
import type { Palette } from './palette'

/** Radii, and length of an arrow's head, in spans of the robot. */
const DISC = 0.046
const SHAFT = 0.0066
const HEAD = 0.021
const HEAD_LENGTH = 0.05
const UP = new Vector3(0, 1, 0)

export class FootMarks {
  readonly object = new Group()
  private readonly discs: Mesh[] = []
  private readonly arrows: Arrow[] = []
  private readonly positions: Float32Array
  private readonly forces: Float32Array
  private readonly discMaterial = new MeshBasicMaterial({ transparent: true, opacity: 0.75 })
  // Drawn through the leg, along which most forces point.
  private readonly arrowMaterial = new MeshBasicMaterial({ depthTest: false, transparent: true })
  private readonly supportMaterial = new MeshBasicMaterial({
    transparent: true,
    opacity: 0.16,
    depthWrite: false,
    side: DoubleSide,
  })
  private readonly support: Mesh<BufferGeometry>
  private readonly force = new Vector3()
  withForces = true
  withSupport = true

  constructor(
    private readonly replay: Replay,
    /** Arrow length per force [m/N]. */
    private readonly scale: number,
    /** Height of discs above the ground [m]; differs between walks, to avoid flicker. */
    private readonly height: number,
    span: number,
  ) {
    const legs = replay.header.robot.legs.length
    this.positions = new Float32Array(3 * legs)
    this.forces = new Float32Array(3 * legs)
    this.support = new Mesh(new BufferGeometry(), this.supportMaterial)
    this.support.geometry.setAttribute(
      'position',
      new BufferAttribute(new Float32Array(9 * legs), 3),
    )
    // Its extent changes, and so would the bounds.
    this.support.frustumCulled = false
    this.object.add(this.support)
    for (let leg = 0; leg < legs; leg++) {
      const disc = new Mesh(new CircleGeometry(DISC * span, 32), this.discMaterial)
      const arrow = new Arrow(this.arrowMaterial, span)
      this.discs.push(disc)
      this.arrows.push(arrow)
      this.object.add(disc, arrow.object)
    }
  }

  show(time: number): void {
    this.replay.sample('foot_position', time, this.positions)
    this.replay.sample('foot_force', time, this.forces)
    this.discs.forEach((disc, leg) => {
      const [x, y, z] = this.positions.subarray(3 * leg, 3 * leg + 3)
      const height = this.replay.header.ground.heights ? z : this.height
      this.force.fromArray(this.forces, 3 * leg)
      const size = this.force.length()
      disc.visible = size > CONTACT_FORCE
      disc.position.set(x, y, height)
      this.arrows[leg].point(x, y, height, this.force, size * this.scale)
      this.arrows[leg].object.visible = disc.visible && this.withForces
    })
    this.showSupport()
  }

  /** Fill the convex hull of the standing feet, as a fan of triangles. */
  private showSupport(): void {
    const standing = this.discs
      .filter(({ visible }) => visible)
      .map(({ position: { x, y, z } }): [number, number, number] => [x, y, z / 2])
    const corners = hull(standing)
    this.support.visible = this.withSupport && corners.length > 2
    const { geometry } = this.support
    const places = geometry.getAttribute('position') as BufferAttribute
    for (let k = 1; k + 1 < corners.length; k++) {
      for (const [n, corner] of [corners[0], corners[k], corners[k + 1]].entries()) {
        places.setXYZ(3 * (k - 1) + n, ...corner)
      }
    }
    places.needsUpdate = true
    geometry.setDrawRange(0, 3 * Math.max(0, corners.length - 2))
  }

  recolour(colours: Palette, accent: Palette['force']): void {
    this.discMaterial.color.copy(accent)
    this.supportMaterial.color.copy(accent)
    this.arrowMaterial.color.copy(colours.force)
  }
}

/** An arrow along a vector with a head of constant size. */
class Arrow {
  readonly object = new Group()
  private readonly shaft: Mesh
  private readonly head: Mesh
  private readonly turn = new Quaternion()
  private readonly direction = new Vector3()
  private readonly headLength: number

  constructor(material: MeshBasicMaterial, span: number) {
    this.headLength = HEAD_LENGTH * span
    const radius = SHAFT * span
    this.shaft = new Mesh(new CylinderGeometry(radius, radius, 1, 12), material)
    this.head = new Mesh(new ConeGeometry(HEAD * span, this.headLength, 20), material)
    this.shaft.renderOrder = 1
    this.head.renderOrder = 1
    this.object.add(this.shaft, this.head)
  }

  point(x: number, y: number, z: number, vector: Vector3, length: number): void {
    const shaft = Math.max(1e-4, length - this.headLength)
    const head = Math.min(1, length / this.headLength)
    this.object.position.set(x, y, z)
    this.direction.copy(vector).normalize()
    this.object.quaternion.copy(this.turn.setFromUnitVectors(UP, this.direction))
    this.shaft.scale.set(1, shaft, 1)
    this.shaft.position.y = shaft / 2
    this.head.scale.setScalar(Math.max(1e-3, head))
    this.head.position.y = length - (head * this.headLength) / 2
  }
}
