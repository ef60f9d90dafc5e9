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
import type { Replay } from '../replay'
import { CameraRig, type ViewName } from './camera-rig'
import { disposeTree } from './dispose'
import { FootMarks } from './foot-marks'
import { Ground } from './ground'
import { palette } from './palette'
import { createRenderer } from './renderer'
import { RobotFigure } from './robot-figure'
import { SlopeMark } from './slope-mark'
import { Trail } from './trail'

export type Arrangement = 'ghost' | 'beside'

export interface SceneOptions {
  readonly arrangement: Arrangement
  readonly follow: boolean
  readonly forces: boolean
  readonly trail: boolean
}

/** Distance between two robots side by side [m]. */
const BESIDE = 0.75

/** Height over the ground that is looked at [m]. */
const MIDDLE = 0.09

/** Half the height that the camera shows of one robot, and of two side by side [m]. */
const REACH = 0.3
const REACH_BESIDE = 0.54

const LIGHT = new Vector3(0.7, -1.1, 2.2)
const DOWN = new Vector3(0, 0, -1)

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

  /** metresPerNewton: of force arrows; onChange: something else is to be drawn. */
  constructor(
    replays: readonly Replay[],
    metresPerNewton: number,
    options: SceneOptions,
    onChange: () => void,
  ) {
    this.renderer = createRenderer()
    this.lanes = replays.map((replay, k) => laneOf(replay, metresPerNewton, 0.003 - 0.001 * k))
    const { gravity, ground } = replays[0].header
    const tilt = new Quaternion().setFromUnitVectors(new Vector3(...gravity).normalize(), DOWN)
    this.world.quaternion.copy(tilt)
    const length = Math.max(...replays.map((r) => r.value('link_pose', r.frames - 1, 0)))
    this.ground = new Ground(
      length,
      -0.38 - (replays.length > 1 ? BESIDE / 2 : 0),
      this.renderer.shadowMap.enabled,
    )
    this.world.add(this.ground.object, ...this.lanes.map((lane) => lane.group))
    this.slope = slopeMark(ground, tilt)
    this.scene.add(this.world, this.sky, this.sun, this.sun.target)
    if (this.slope) this.scene.add(this.slope.object)
    this.prepareShadows()
    this.rig = new CameraRig(this.canvas, onChange)
    this.recolour()
    this.setOptions(options)
    this.show(0)
    this.rig.look('three-quarter')
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
    this.centre.z = MIDDLE
    this.world.localToWorld(this.centre)
    this.slope?.moveTo(this.centre)
    this.sun.target.position.copy(this.centre)
    this.sun.position.copy(this.centre).add(LIGHT)
    this.rig.moveTarget(this.centre)
  }

  setOptions(options: SceneOptions): void {
    const beside = options.arrangement === 'beside' && this.lanes.length > 1
    this.lanes.forEach(({ group, figure, feet, trail }, k) => {
      group.position.y = beside ? (k - 0.5) * BESIDE : 0
      figure.setGhost(k > 0 && !beside)
      feet.setForces(options.forces && (beside || k === 0))
      trail.object.visible = options.trail
    })
    const { ground } = this.lanes[0].replay.header
    const room = beside ? BESIDE / 2 : 0
    this.slope?.placeAt(slopeCorner(ground, this.world.quaternion, room))
    this.slope?.moveTo(this.centre)
    this.rig.follow = options.follow
    const reach = beside ? REACH_BESIDE : REACH
    if (reach === this.rig.reach) return
    this.rig.reach = reach
    this.rig.look('three-quarter')
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

  turn(around: number, up: number): void {
    this.rig.turn(around, up)
  }

  zoom(factor: number): void {
    this.rig.zoom(factor)
  }

  resize(width: number, height: number): void {
    this.renderer.setSize(width, height)
    this.rig.resize(width, height)
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

  private prepareShadows(): void {
    const { shadow } = this.sun
    this.sun.castShadow = true
    shadow.mapSize.set(1024, 1024)
    shadow.radius = 3
    shadow.bias = -0.0004
    shadow.normalBias = 0.004
    Object.assign(shadow.camera, {
      left: -0.9,
      right: 0.9,
      top: 0.9,
      bottom: -0.9,
      near: 1,
      far: 4,
    })
  }
}

/** discs: height of the feet's marks [m]. */
function laneOf(replay: Replay, metresPerNewton: number, discs: number): Lane {
  const group = new Group()
  const figure = new RobotFigure(replay)
  const feet = new FootMarks(replay, metresPerNewton, discs)
  const trail = new Trail(replay)
  group.add(figure.object, feet.object, trail.object)
  return { replay, group, figure, feet, trail }
}

/** None on level ground. tilt: from the ground's world to the scene. */
function slopeMark(ground: Replay['header']['ground'], tilt: Quaternion): SlopeMark | null {
  if (ground.slope_deg === 0) return null
  return new SlopeMark(ground.slope_deg, uphill(ground).applyQuaternion(tilt))
}

/** Where the mark stands clear of the robots, from what is looked at. room: for robots [m]. */
function slopeCorner(ground: Replay['header']['ground'], tilt: Quaternion, room: number): Vector3 {
  const rises = uphill(ground)
  return new Vector3(-rises.y, rises.x, 0)
    .multiplyScalar(0.34 + room)
    .addScaledVector(rises, -0.1)
    .setZ(0.003 - MIDDLE)
    .applyQuaternion(tilt)
}

/** Up the ground, in the ground's world. */
function uphill({ slope_deg, slope_direction_deg }: Replay['header']['ground']): Vector3 {
  const direction = (slope_direction_deg * Math.PI) / 180
  const rises = new Vector3(Math.cos(direction), Math.sin(direction), 0)
  return slope_deg < 0 ? rises.negate() : rises
}
