/** Orbiting camera that can follow the robot. */

import { PerspectiveCamera, Vector3 } from 'three'
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js'

/** View directions, x forward, y left, z up; relative to the distance. */
const VIEWS = {
  'three-quarter': [0.5, -0.87, 0.48],
  side: [0, -1, 0.12],
  front: [1, -0.001, 0.2],
  top: [0.001, -0.02, 1],
} as const

export type ViewName = keyof typeof VIEWS

/** Smallest and largest distance, and clipping planes, in spans of the robot. */
const NEAREST = 0.47
const FURTHEST = 11.3
const SEEN = [0.038, 113] as const

type Point = readonly [x: number, y: number, z: number]

/** Camera position and target [m], relative to the robots while following, otherwise to the start. */
export interface CameraPlace {
  readonly position: Point
  readonly target: Point
}

export class CameraRig {
  readonly camera = new PerspectiveCamera(32, 1)
  /** Called when the camera was moved by the user or to a view; null for the default view. */
  onPlaced: (place: CameraPlace | null) => void = () => undefined
  private following = true
  /** Half the visible height [m]. */
  reach = 1
  readonly controls: OrbitControls
  private readonly target = new Vector3()
  private readonly step = new Vector3()
  private aspect = 1

  constructor(
    canvas: HTMLCanvasElement,
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
    // Without focus, the wheel scrolls the page.
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

  /** Move the target; the camera moves along while following. */
  moveTarget(target: Vector3): void {
    this.step.subVectors(target, this.target)
    this.target.copy(target)
    if (!this.following) return
    this.controls.target.add(this.step)
    this.camera.position.add(this.step)
    this.controls.update()
  }

  /** Set a view direction, with the whole robot visible. */
  look(from: ViewName): void {
    const narrow = Math.min(1, this.aspect)
    const fittingDistance = this.reach / (narrow * Math.tan((16 * Math.PI) / 180))
    const distance = Math.min(FURTHEST * this.span, fittingDistance)
    const direction = new Vector3(...VIEWS[from]).normalize()
    this.controls.target.copy(this.target)
    this.camera.position.copy(this.target).addScaledVector(direction, distance)
    this.controls.update()
    this.onPlaced(from === 'three-quarter' && this.following ? null : this.place)
  }

  turn(around: number, up: number): void {
    this.controls.rotateLeft(-around)
    this.controls.rotateUp(up)
    this.onPlaced(this.place)
  }

  zoom(factor: number): void {
    this.controls.dollyIn(1 / factor)
    this.onPlaced(this.place)
  }

  resize(width: number, height: number): void {
    this.aspect = width / height
    this.camera.aspect = this.aspect
    this.camera.updateProjectionMatrix()
  }
}
