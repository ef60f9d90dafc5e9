/** Robot of a scene: shapes or meshes on its links. */

import {
  BoxGeometry,
  type BufferGeometry,
  CapsuleGeometry,
  type Color,
  CylinderGeometry,
  Group,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three'
import { RoundedBoxGeometry } from 'three/examples/jsm/geometries/RoundedBoxGeometry.js'
import type { Replay, Shape } from '../replay/replay'
import type { FigurePalette, Palette } from './palette'

type Part = 'frame' | 'accent' | 'limb' | 'joint' | 'load'

const PARTS: Readonly<Record<Shape['role'], Part>> = {
  body: 'frame',
  coxa: 'joint',
  femur: 'accent',
  tibia: 'limb',
  foot: 'joint',
  load: 'load',
}

/** Numbers per pose: x y z [m] and a unit quaternion x y z w. */
const POSE = 7

const GHOST = 0.38

export class RobotFigure {
  readonly object = new Group()
  private readonly links: Group[] = []
  private readonly materials: Readonly<Record<Part, MeshStandardMaterial>> = {
    frame: new MeshStandardMaterial({ roughness: 0.55, metalness: 0.25 }),
    accent: new MeshStandardMaterial({ roughness: 0.45, metalness: 0.1 }),
    limb: new MeshStandardMaterial({ roughness: 0.4, metalness: 0.35 }),
    joint: new MeshStandardMaterial({ roughness: 0.7, metalness: 0.1 }),
    load: new MeshStandardMaterial({ roughness: 0.8 }),
  }
  private readonly place = new Vector3()
  private readonly turn = new Quaternion()
  /** By link: its simplified shapes except loads, and the meshes that replace them. */
  private readonly solids: Object3D[][] = []
  private readonly meshes: Object3D[][] = []
  private ghost = false

  constructor(private readonly replay: Replay) {
    const { links } = replay.header.robot
    for (const { shapes } of links) {
      const group = new Group()
      const solids: Object3D[] = []
      for (const shape of shapes) {
        const before = group.children.length
        this.addShape(group, shape)
        if (shape.role !== 'load') solids.push(...group.children.slice(before))
      }
      this.solids.push(solids)
      this.meshes.push([])
      this.links.push(group)
      this.object.add(group)
    }
  }

  show(time: number): void {
    const { values } = this.replay
    const { a, b, share } = this.replay.around('link_pose', time)
    this.links.forEach(({ position, quaternion }, k) => {
      const at = k * POSE
      position.fromArray(values, a + at).lerp(this.place.fromArray(values, b + at), share)
      quaternion.fromArray(values, a + at + 3)
      quaternion.slerp(this.turn.fromArray(values, b + at + 3), share)
    })
  }

  /** Position of the body in the world [m]. */
  get body(): Vector3 {
    return this.links[0].position
  }

  recolour(palette: Palette, colours: FigurePalette): void {
    const each: Record<Part, Color> = { ...colours, load: palette.load }
    for (const part of Object.keys(each) as Part[]) this.materials[part].color.copy(each[part])
  }

  setGhost(ghost: boolean): void {
    this.ghost = ghost
    for (const material of [...Object.values(this.materials), ...this.meshMaterials()]) {
      makeGhost(material, ghost)
    }
    this.object.traverse((object) => {
      object.castShadow = !ghost
    })
  }

  /** Add a mesh to a link; takes ownership of the object. */
  addMesh(link: number, object: Object3D): void {
    this.links[link].add(object)
    this.meshes[link].push(object)
    for (const material of this.meshMaterials()) makeGhost(material, this.ghost)
  }

  /** Show meshes where available, or simplified shapes. */
  showMeshes(shown: boolean): void {
    this.meshes.forEach((meshes, link) => {
      for (const mesh of meshes) mesh.visible = shown
      for (const solid of this.solids[link]) solid.visible = !shown || meshes.length === 0
    })
  }

  private meshMaterials(): MeshStandardMaterial[] {
    const materials: MeshStandardMaterial[] = []
    for (const mesh of this.meshes.flat()) {
      mesh.traverse((object) => {
        if (object instanceof Mesh) materials.push(object.material)
      })
    }
    return materials
  }

  private addShape(link: Group, shape: Shape): void {
    const solid = this.mesh(solidOf(shape), PARTS[shape.role])
    solid.position.fromArray(shape.origin)
    solid.quaternion.fromArray(shape.origin, 3)
    link.add(solid)
    if (shape.type === 'box' && shape.role === 'body') this.markFront(solid, shape.size)
    if (shape.type === 'capsule') {
      // A hub at the joint separates the limbs visually.
      link.add(this.mesh(new SphereGeometry(shape.size[0] * 1.18, 24, 16), 'joint'))
    }
  }

  private markFront(body: Mesh, [length, width, height]: readonly number[]): void {
    const stripe = this.mesh(new BoxGeometry(0.16 * length, 0.62 * width, 0.02 * height), 'accent')
    stripe.position.set(0.34 * length, 0, 0.51 * height)
    body.add(stripe)
  }

  private mesh(geometry: BufferGeometry, part: Part): Mesh {
    const mesh = new Mesh(geometry, this.materials[part])
    mesh.castShadow = true
    mesh.receiveShadow = true
    return mesh
  }
}

function makeGhost(material: MeshStandardMaterial, ghost: boolean): void {
  material.transparent = ghost
  material.opacity = ghost ? GHOST : 1
  material.depthWrite = !ghost
  // At equal depth, the first robot is visible.
  material.polygonOffset = ghost
  material.polygonOffsetFactor = 2
  material.polygonOffsetUnits = 40
  material.needsUpdate = true
}

/** three's capsules and cylinders lie along y, recorded ones along z. */
function solidOf({ type, size }: Shape): BufferGeometry {
  switch (type) {
    case 'box':
      return new RoundedBoxGeometry(size[0], size[1], size[2], 3, 0.12 * Math.min(...size))
    case 'sphere':
      return new SphereGeometry(size[0], 24, 16)
    case 'cylinder':
      return new CylinderGeometry(size[0], size[0], size[1], 32).rotateX(Math.PI / 2)
    case 'capsule':
      return new CapsuleGeometry(size[0], size[1], 8, 24).rotateX(Math.PI / 2)
  }
}
