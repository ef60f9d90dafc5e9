/** The camera: orbits about the robot by hand, and walks along with it if asked to. */

import { PerspectiveCamera, Spherical, Vector3 } from 'three'
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js'

/** Directions to look from, x ahead, y left, z up; lengths are shares of the distance. */
const VIEWS = {
  'three-quarter': [0.5, -0.87, 0.48],
  side: [0, -1, 0.12],
  front: [1, -0.001, 0.2],
  top: [0.001, -0.02, 1],
} as const

export type ViewName = keyof typeof VIEWS

/** How near and how far the camera may be, and what it sees at all, in spans of the robot. */
const NEAREST = 0.47
const FURTHEST = 11.3
const SEEN = [0.038, 113] as const

type Point = readonly [x: number, y: number, z: number]

/** Where the camera is and what it is turned to, from the robots' middle while it follows them, else from
 * where the walk begins [m]. */
export interface CameraPlace {
  readonly position: Point
  readonly target: Point
}

export class CameraRig {
  readonly camera = new PerspectiveCamera(32, 1)
  /** Called when it was placed by hand, by a key or for a view; null: as it is at first. */
  onPlaced: (place: CameraPlace | null) => void = () => undefined
  private following = true
  /** Half the height of what is to be seen [m]. */
  reach = 1
  private readonly controls: OrbitControls
  private readonly target = new Vector3()
  private readonly step = new Vector3()
  private aspect = 1

  constructor(
    canvas: HTMLCanvasElement,
    /** Of the robot [m]. */
    private readonly span: number,
    onChange: () => void,
  ) {
    this.camera.near = SEEN[0] * span
    this.camera.far = SEEN[1] * span
    this.camera.up.set(0, 0, 1)
    this.controls = new OrbitControls(this.camera, canvas)
    this.controls.minDistance = NEAREST * span
    this.controls.maxDistance = FURTHEST * span
    this.controls.maxPolarAngle = 0.56 * Math.PI
    this.controls.addEventListener('change', onChange)
    this.controls.addEventListener('end', () => this.onPlaced(this.place))
    // The wheel scrolls the page, as long as the scene was not clicked or reached by Tab.
    this.controls.enableZoom = false
    canvas.addEventListener('focus', () => {
      this.controls.enableZoom = true
    })
    canvas.addEventListener('blur', () => {
      this.controls.enableZoom = false
    })
    canvas.style.touchAction = 'pan-y'
  }

  get place(): CameraPlace {
    const origin = this.following ? this.target : new Vector3()
    const from = (point: Vector3): Point => point.clone().sub(origin).toArray()
    return { position: from(this.camera.position), target: from(this.controls.target) }
  }

  set place({ position, target }: CameraPlace) {
    const origin = this.following ? this.target : new Vector3()
    this.camera.position.set(...position).add(origin)
    this.controls.target.set(...target).add(origin)
    this.controls.update()
  }

  set follow(follow: boolean) {
    if (follow === this.following) return
    this.following = follow
    this.onPlaced(this.place)
  }

  /** What is being looked at moved there; both stay as far from each other if it is followed. */
  moveTarget(target: Vector3): void {
    this.step.subVectors(target, this.target)
    this.target.copy(target)
    if (!this.following) return
    this.controls.target.add(this.step)
    this.camera.position.add(this.step)
    this.controls.update()
  }

  /** Look from a direction, all of the robot in view. */
  look(from: ViewName): void {
    const narrow = Math.min(1, this.aspect)
    const wanted = this.reach / (narrow * Math.tan((16 * Math.PI) / 180))
    const distance = Math.min(FURTHEST * this.span, wanted)
    const direction = new Vector3(...VIEWS[from]).normalize()
    this.controls.target.copy(this.target)
    this.camera.position.copy(this.target).addScaledVector(direction, distance)
    this.controls.update()
    this.onPlaced(from === 'three-quarter' && this.following ? null : this.place)
  }

  /** Turn about what is looked at [rad]. */
  turn(around: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target)
    // Spherical has y up, the scene z.
    const angles = new Spherical().setFromVector3(new Vector3(offset.x, offset.z, -offset.y))
    angles.theta += around
    angles.phi = Math.min(0.56 * Math.PI, Math.max(0.02, angles.phi - up))
    const turned = new Vector3().setFromSpherical(angles)
    this.camera.position.copy(this.controls.target).add(new Vector3(turned.x, -turned.z, turned.y))
    this.controls.update()
    this.onPlaced(this.place)
  }

  /** Come nearer by a factor. */
  zoom(factor: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target)
    const length = Math.min(
      FURTHEST * this.span,
      Math.max(NEAREST * this.span, offset.length() / factor),
    )
    this.camera.position.copy(this.controls.target).add(offset.setLength(length))
    this.controls.update()
    this.onPlaced(this.place)
  }

  resize(width: number, height: number): void {
    this.aspect = width / height
    this.camera.aspect = this.aspect
    this.camera.updateProjectionMatrix()
  }

  dispose(): void {
    this.controls.dispose()
  }
}
