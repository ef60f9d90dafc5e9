/** Scene with one or two walks. */

import {
  BufferAttribute,
  BufferGeometry,
  DirectionalLight,
  Group,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  Quaternion,
  Scene,
  Vector3,
  type WebGLRenderer,
} from 'three'
import type { Extent } from '../replay/extent'
import { hasMeshes, type Replay } from '../replay/replay'
import { type CameraPlace, CameraRig } from './camera-rig'
import { FootMarks } from './foot-marks'
import { Ground } from './ground'
import { palette } from './palette'
import { createRenderer, disposeScene } from './renderer'
import { RobotFigure } from './robot-figure'
import { type SlopeMark, slopeCorner, slopeMark } from './slope-mark'

type Arrangement = 'ghost' | 'side-by-side'

export interface SceneOptions {
  readonly arrangement: Arrangement
  readonly follow: boolean
  readonly forces: boolean
  readonly trail: boolean
  /** Show the polygon of the standing feet. */
  readonly support: boolean
  /** Show the URDF's meshes if loaded, instead of simplified shapes. */
  readonly meshes: boolean
}

/** Distance between robots side by side, in widths. */
const SPACING = 1.55

/** Height of the target above the ground, in heights of the robot. */
const MIDDLE = 0.45

/** Half the visible height for one robot, in spans, and its increase for two side by side, in distances
 * between them. */
const REACH = 0.58
const REACH_SIDE_BY_SIDE = 0.32

/** Lateral positions of labels and of slope marks, in widths. */
const LABELS = 0.78
const SLOPE = 0.7

/** Elevation of the first walk's foot marks, and by how much the second's are lower, in spans. */
const MARKS = 0.006
const MARKS_LOWER = 0.002

/** Direction of the light, and half the edge of the shadow area, in spans. */
const LIGHT = new Vector3(1.3, -2.1, 4.2)
const SHADED = 1.7
const DOWN = new Vector3(0, 0, -1)

type Size = readonly [width: number, height: number]

interface Lane {
  readonly replay: Replay
  readonly group: Group
  readonly figure: RobotFigure
  readonly feet: FootMarks
  readonly trail: Line<BufferGeometry, LineBasicMaterial>
}

export class WalkScene {
  private readonly renderer: WebGLRenderer
  private readonly scene = new Scene()
  /** The ground's frame, tilted so that gravity points down. */
  private readonly world = new Group()
  private readonly lanes: readonly Lane[]
  private readonly ground: Ground
  private readonly slope: SlopeMark | null
  private readonly sky = new HemisphereLight(0xffffff, 0x9aa4a9, 1.9)
  private readonly sun = new DirectionalLight(0xffffff, 2.4)
  readonly rig: CameraRig
  private readonly centre = new Vector3()
  /** Device pixels per CSS pixel. */
  private readonly density: number
  private shownSize: Size = [1, 1]
  private filmSize: Size | null = null

  /** newtons: force of an arrow per grid cell; onChange: requests a redraw. */
  constructor(
    replays: readonly Replay[],
    private readonly extent: Extent,
    newtons: number,
    options: SceneOptions,
    private readonly onChange: () => void,
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
      -LABELS * width - (replays.length > 1 ? this.spacing / 2 : 0),
      extent,
      this.renderer.shadowMap.enabled,
      ground.heights,
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

  /** Distance between robots side by side [m]. */
  private get spacing(): number {
    return SPACING * this.extent.width
  }

  /** Height of the target above the ground [m]. */
  private get middle(): number {
    return MIDDLE * this.extent.height
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer.domElement
  }

  /** Show a time [s]; a finished walk stays at its end. */
  show(time: number): void {
    this.centre.set(0, 0, 0)
    for (const { replay, figure, feet, trail, group } of this.lanes) {
      figure.show(time)
      feet.show(time)
      trail.geometry.setDrawRange(0, replay.frameAt(time) + 1)
      const { x, y } = figure.body
      this.centre.x += x / this.lanes.length
      this.centre.y += (y + group.position.y) / this.lanes.length
    }
    this.ground.moveTo(this.centre.x, this.centre.y)
    // Constant, so that the body's vertical movement is visible.
    this.centre.z = this.middle
    this.world.localToWorld(this.centre)
    this.slope?.moveTo(this.centre)
    this.sun.target.position.copy(this.centre)
    this.sun.position.copy(this.centre).addScaledVector(LIGHT, this.extent.span)
    this.rig.moveTarget(this.centre)
  }

  setOptions(options: SceneOptions): void {
    const sideBySide = options.arrangement === 'side-by-side' && this.lanes.length > 1
    this.lanes.forEach(({ group, figure, feet, trail }, k) => {
      group.position.y = sideBySide ? (k - 0.5) * this.spacing : 0
      figure.setGhost(k > 0 && !sideBySide)
      figure.showMeshes(options.meshes)
      feet.withForces = options.forces && (sideBySide || k === 0)
      feet.withSupport = options.support && (sideBySide || k === 0)
      trail.visible = options.trail
    })
    const { ground } = this.lanes[0].replay.header
    const room = SLOPE * this.extent.width + (sideBySide ? this.spacing / 2 : 0)
    const foot = MARKS * this.extent.span - this.middle
    const corner = slopeCorner(ground, room, this.extent.span, foot)
    this.slope?.corner.copy(corner.applyQuaternion(this.world.quaternion))
    this.slope?.moveTo(this.centre)
    this.rig.follow = options.follow
    const reach = REACH * this.extent.span + (sideBySide ? REACH_SIDE_BY_SIDE * this.spacing : 0)
    if (reach === this.rig.reach) return
    this.rig.reach = reach
    this.rig.look('three-quarter')
  }

  async loadMeshes(shown: () => boolean, signal: AbortSignal): Promise<number> {
    let count = 0
    for (const { replay, figure } of this.lanes) {
      if (!hasMeshes(replay.header)) continue
      const { meshesOf } = await import('./link-meshes')
      const loaded = await meshesOf(replay.header.robot, signal)
      signal.throwIfAborted()
      for (const { link, object } of loaded) figure.addMesh(link, object)
      figure.showMeshes(shown())
      count += loaded.length
    }
    return count
  }

  recolour(): void {
    const colours = palette()
    this.scene.background = colours.background
    this.ground.recolour(colours)
    this.slope?.recolour(colours.text)
    this.lanes.forEach(({ figure, feet, trail }, k) => {
      const walkColours = colours.walks[k]
      figure.recolour(colours, walkColours)
      feet.recolour(colours, walkColours.accent)
      trail.material.color.copy(walkColours.accent)
    })
  }

  /** place: initial camera, null for the default view; onPlaced: called when the user moves it. */
  placeCamera(place: CameraPlace | null, onPlaced: (place: CameraPlace | null) => void): void {
    if (place === null) this.rig.look('three-quarter')
    else this.rig.place = place
    this.rig.onPlaced = onPlaced
  }

  resize(width: number, height: number): void {
    this.shownSize = [width, height]
    this.fit()
    this.onChange()
  }

  /** Render at this size [px], scaled to the canvas; null for the canvas's size. */
  film(size: Size | null): void {
    this.filmSize = size
    this.fit()
    this.render()
  }

  /** Current view as a PNG of this size [px]. */
  picture(size: Size): Promise<Blob> {
    this.film(size)
    // Pixels are captured before the next redraw.
    const png = new Promise<Blob>((done, fail) =>
      this.canvas.toBlob((blob) =>
        blob ? done(blob) : fail(new Error('The browser cannot create a picture of this size.')),
      ),
    )
    this.film(null)
    return png
  }

  render(): void {
    this.world.updateMatrixWorld()
    this.renderer.render(this.scene, this.rig.camera)
  }

  dispose(): void {
    this.rig.controls.dispose()
    this.sun.dispose()
    this.sky.dispose()
    disposeScene(this.scene, this.renderer)
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
  const trail = trailOf(replay)
  group.add(figure.object, feet.object, trail)
  return { replay, group, figure, feet, trail }
}

function trailOf(replay: Replay): Lane['trail'] {
  const points = [0, 1, 2].map((i) => replay.column('link_pose', i))
  const places = Float32Array.from(
    { length: 3 * replay.frames },
    (_, k) => points[k % 3][(k / 3) | 0],
  )
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(places, 3))
  const trail = new Line(geometry, new LineBasicMaterial())
  // The drawn range changes, and so would the bounds.
  trail.frustumCulled = false
  return trail
}
