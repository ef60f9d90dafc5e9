/** One walk or two in three dimensions: everything that is drawn, and the moment that it shows. */

import {
  DirectionalLight,
  Group,
  HemisphereLight,
  Quaternion,
  Scene,
  Vector3,
  type WebGLRenderer,
} from 'three'
import type { Extent } from '../replay/extent'
import { hasMeshes, type Replay } from '../replay/replay'
import { type CameraPlace, CameraRig, type ViewName } from './camera-rig'
import { disposeTree } from './dispose'
import { FootMarks } from './foot-marks'
import { Ground } from './ground'
import { palette } from './palette'
import { createRenderer } from './renderer'
import { RobotFigure } from './robot-figure'
import { type SlopeMark, slopeCorner, slopeMark } from './slope-mark'
import { Trail } from './trail'

type Arrangement = 'ghost' | 'beside'

export interface SceneOptions {
  readonly arrangement: Arrangement
  readonly follow: boolean
  readonly forces: boolean
  readonly trail: boolean
  /** Links by the URDF's meshes, where they were loaded, or by simple solids. */
  readonly meshes: boolean
}

/** Distance between two robots side by side, in widths of one. */
const BESIDE = 1.55

/** Height over the ground that is looked at, in heights of the robot. */
const MIDDLE = 0.45

/** Half the height that the camera shows of one robot, in spans, and what it shows more of two
 * side by side, in distances between them. */
const REACH = 0.58
const REACH_BESIDE = 0.32

/** Where labels stand, and marks of slopes, from the middle of a robot, in widths. */
const LABELS = 0.78
const SLOPE = 0.7

/** Height of the first walk's marks of feet, and how much lower the second's are, in spans. */
const MARKS = 0.006
const MARKS_LOWER = 0.002

/** Where the light comes from, and half the edge of what has a shadow, in spans. */
const LIGHT = new Vector3(1.3, -2.1, 4.2)
const SHADED = 1.7
const DOWN = new Vector3(0, 0, -1)

type Size = readonly [width: number, height: number]

interface Lane {
  readonly replay: Replay
  readonly group: Group
  readonly figure: RobotFigure
  readonly feet: FootMarks
  readonly trail: Trail
}

export class WalkScene {
  private readonly renderer: WebGLRenderer
  private readonly scene = new Scene()
  /** The ground's world, tilted so that gravity points down. */
  private readonly world = new Group()
  private readonly lanes: readonly Lane[]
  private readonly ground: Ground
  private readonly slope: SlopeMark | null
  private readonly sky = new HemisphereLight(0xffffff, 0x9aa4a9, 1.9)
  private readonly sun = new DirectionalLight(0xffffff, 2.4)
  private readonly rig: CameraRig
  private readonly centre = new Vector3()
  /** Pixels of a picture for one of the page. */
  private readonly density: number
  private shownSize: Size = [1, 1]
  private filmSize: Size | null = null

  /** newtons: an arrow's for one cell of the grid; onChange: something else is to be drawn. */
  constructor(
    replays: readonly Replay[],
    private readonly extent: Extent,
    newtons: number,
    options: SceneOptions,
    onChange: () => void,
  ) {
    this.renderer = createRenderer()
    this.density = this.renderer.getPixelRatio()
    const { span, width, cell } = extent
    this.lanes = replays.map((replay, k) => {
      const height = (MARKS - MARKS_LOWER * k) * span
      return laneOf(replay, new FootMarks(replay, cell / newtons, height, span))
    })
    const { gravity, ground } = replays[0].header
    const tilt = new Quaternion().setFromUnitVectors(new Vector3(...gravity).normalize(), DOWN)
    this.world.quaternion.copy(tilt)
    const length = Math.max(...replays.map((r) => r.value('link_pose', r.frames - 1, 0)))
    this.ground = new Ground(
      length,
      -LABELS * width - (replays.length > 1 ? this.beside / 2 : 0),
      extent,
      this.renderer.shadowMap.enabled,
    )
    this.world.add(this.ground.object, ...this.lanes.map((lane) => lane.group))
    this.slope = slopeMark(ground, tilt, span)
    this.scene.add(this.world, this.sky, this.sun, this.sun.target)
    if (this.slope) this.scene.add(this.slope.object)
    this.prepareShadows()
    this.rig = new CameraRig(this.canvas, span, onChange)
    this.recolour()
    this.setOptions(options)
    this.show(0)
    this.rig.look('three-quarter')
  }

  /** Distance between two robots side by side [m]. */
  private get beside(): number {
    return BESIDE * this.extent.width
  }

  /** Height over the ground that is looked at [m]. */
  private get middle(): number {
    return MIDDLE * this.extent.height
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer.domElement
  }

  /** Geometries in the graphics memory, which must not grow while a walk plays. */
  get geometries(): number {
    return this.renderer.info.memory.geometries
  }

  /** Put everything where it was at a time [s]; a walk that ended stays at its end. */
  show(time: number): void {
    this.centre.set(0, 0, 0)
    for (const { figure, feet, trail, group } of this.lanes) {
      figure.show(time)
      feet.show(time)
      trail.show(time)
      const [x, y] = figure.body
      this.centre.x += x / this.lanes.length
      this.centre.y += (y + group.position.y) / this.lanes.length
    }
    this.ground.moveTo(this.centre.x, this.centre.y)
    // Not the body itself: its own rise and fall is to be seen.
    this.centre.z = this.middle
    this.world.localToWorld(this.centre)
    this.slope?.moveTo(this.centre)
    this.sun.target.position.copy(this.centre)
    this.sun.position.copy(this.centre).addScaledVector(LIGHT, this.extent.span)
    this.rig.moveTarget(this.centre)
  }

  setOptions(options: SceneOptions): void {
    const beside = options.arrangement === 'beside' && this.lanes.length > 1
    this.lanes.forEach(({ group, figure, feet, trail }, k) => {
      group.position.y = beside ? (k - 0.5) * this.beside : 0
      figure.setGhost(k > 0 && !beside)
      figure.showMeshes(options.meshes)
      feet.setForces(options.forces && (beside || k === 0))
      trail.object.visible = options.trail
    })
    const { ground } = this.lanes[0].replay.header
    const room = SLOPE * this.extent.width + (beside ? this.beside / 2 : 0)
    const foot = MARKS * this.extent.span - this.middle
    const corner = slopeCorner(ground, room, this.extent.span, foot)
    this.slope?.placeAt(corner.applyQuaternion(this.world.quaternion))
    this.slope?.moveTo(this.centre)
    this.rig.follow = options.follow
    const reach = REACH * this.extent.span + (beside ? REACH_BESIDE * this.beside : 0)
    if (reach === this.rig.reach) return
    this.rig.reach = reach
    this.rig.look('three-quarter')
  }

  /** Load the meshes of the robots; how many there are now. Throws what a browser says. */
  async loadMeshes(shown: () => boolean, signal: AbortSignal): Promise<number> {
    let count = 0
    for (const { replay, figure } of this.lanes) {
      if (!hasMeshes(replay.header)) continue
      const { meshesOf } = await import('./link-meshes')
      const found = await meshesOf(replay.header.robot, signal)
      signal.throwIfAborted()
      for (const { link, object } of found) figure.addMesh(link, object)
      figure.showMeshes(shown())
      count += found.length
    }
    return count
  }

  /** Take over the page's colours. */
  recolour(): void {
    const colours = palette()
    this.scene.background = colours.background
    this.ground.recolour(colours)
    this.slope?.recolour(colours.text)
    this.lanes.forEach(({ figure, feet, trail }, k) => {
      const own = colours.walks[k]
      figure.recolour(colours, own)
      feet.recolour(colours, own.accent)
      trail.recolour(own.accent)
    })
  }

  look(from: ViewName): void {
    this.rig.look(from)
  }

  /** place: of the camera at first, null for the usual one; onPlaced: is told where it was put later. */
  placeCamera(place: CameraPlace | null, onPlaced: (place: CameraPlace | null) => void): void {
    if (place === null) this.rig.look('three-quarter')
    else this.rig.place = place
    this.rig.onPlaced = onPlaced
  }

  turn(around: number, up: number): void {
    this.rig.turn(around, up)
  }

  zoom(factor: number): void {
    this.rig.zoom(factor)
  }

  resize(width: number, height: number): void {
    this.shownSize = [width, height]
    this.fit()
  }

  /** Draw pictures of this size [px], which the page scales to its own; null: in the page's own. */
  film(size: Size | null): void {
    this.filmSize = size
    this.fit()
    this.render()
  }

  /** What is seen now, as a PNG of this size [px]. */
  picture(size: Size): Promise<Blob> {
    this.film(size)
    // The pixels are taken before the page draws again.
    const taken = new Promise<Blob>((done, fail) =>
      this.canvas.toBlob((blob) =>
        blob ? done(blob) : fail(new Error('The browser makes no picture of this size.')),
      ),
    )
    this.film(null)
    return taken
  }

  render(): void {
    this.world.updateMatrixWorld()
    this.renderer.render(this.scene, this.rig.camera)
  }

  /** Give everything back; the scene cannot be used again. */
  dispose(): void {
    this.rig.dispose()
    disposeTree(this.scene)
    this.sun.dispose()
    this.sky.dispose()
    this.renderer.dispose()
    this.renderer.forceContextLoss()
    this.canvas.remove()
  }

  private fit(): void {
    const filmed = this.filmSize !== null
    const [width, height] = this.filmSize ?? this.shownSize
    this.renderer.setPixelRatio(filmed ? 1 : this.density)
    this.renderer.setSize(width, height, !filmed)
    this.rig.resize(width, height)
  }

  private prepareShadows(): void {
    const { shadow } = this.sun
    const { span } = this.extent
    this.sun.castShadow = true
    shadow.mapSize.set(1024, 1024)
    shadow.radius = 3
    shadow.bias = -0.0004
    shadow.normalBias = 0.0075 * span
    Object.assign(shadow.camera, {
      left: -SHADED * span,
      right: SHADED * span,
      top: SHADED * span,
      bottom: -SHADED * span,
      near: 1.9 * span,
      far: 7.6 * span,
    })
  }
}

function laneOf(replay: Replay, feet: FootMarks): Lane {
  const group = new Group()
  const figure = new RobotFigure(replay)
  const trail = new Trail(replay)
  group.add(figure.object, feet.object, trail.object)
  return { replay, group, figure, feet, trail }
}
