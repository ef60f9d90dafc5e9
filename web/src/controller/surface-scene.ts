/** A three-dimensional surface with axes and a selected point. */

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  Group,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from 'three'
import { formatExact, formatNumber, withUnit } from '../format/number'
import { currentTheme, themeColour } from '../theme'
import { type CameraPlace, CameraRig } from '../walk/scene/camera-rig'
import { facingText } from '../walk/scene/label'
import { palette } from '../walk/scene/palette'
import { createRenderer, disposeScene, disposeTree } from '../walk/scene/renderer'
import { diverging } from './colour-map'
import type { Cell, Layer } from './surface'

/** Half the edge lengths of the box that the surface fills. */
const HALF = { error: 0.75, current: 0.55, value: 0.36 } as const

const NET = 16

const TEXT = 0.075

export class SurfaceScene {
  private readonly renderer = createRenderer()
  readonly rig = new CameraRig(this.canvas, 1, () => this.request())
  private readonly scene = new Scene()
  private readonly marker = new Mesh(new SphereGeometry(0.022, 24, 16), new MeshBasicMaterial())
  private drawn = new Group()
  private requested = 0

  constructor(
    private layer: Layer,
    private cell: Cell,
  ) {
    const { camera, controls } = this.rig
    camera.fov = 30
    controls.enablePan = false
    controls.maxPolarAngle = Math.PI
    const light = new DirectionalLight(0xffffff, 1.1)
    light.position.set(-1, -1.5, 3)
    this.scene.add(new HemisphereLight(0xffffff, 0xb0b8bc, 2.4), light, this.marker)
    this.show(layer, cell)
  }

  get canvas(): HTMLCanvasElement {
    return this.renderer.domElement
  }

  show(layer: Layer, cell: Cell): void {
    this.layer = layer
    disposeTree(this.drawn)
    this.drawn.removeFromParent()
    this.drawn = new Group()
    const colours = palette()
    this.scene.background = colours.background
    const line = new Color().copy(colours.metre)
    this.drawn.add(surfaceOf(layer), netOf(layer, currentTheme()), frameOf(line))
    this.drawn.add(...labelsOf(layer, themeColour('--text')))
    this.scene.add(this.drawn)
    ;(this.marker.material as MeshBasicMaterial).color.copy(colours.force)
    this.mark(cell)
  }

  mark(cell: Cell): void {
    this.cell = cell
    this.marker.position.copy(placeOf(this.layer, this.cell.error, this.cell.current))
    this.request()
  }

  resetView(): void {
    this.look(null)
    this.rig.onPlaced(null)
  }

  /** Set the camera, or the default view for null. */
  look(place: CameraPlace | null): void {
    const near = Math.min(1, this.rig.camera.aspect / 1.5)
    const position = [-1.35 / near, -2.75 / near, 1.75 / near] as const
    this.rig.place = place ?? { position, target: [0, 0, -0.04] }
  }

  resize(width: number, height: number): void {
    this.renderer.setSize(width, height)
    this.rig.resize(width, height)
    this.request()
  }

  render(): void {
    this.renderer.render(this.scene, this.rig.camera)
  }

  dispose(): void {
    cancelAnimationFrame(this.requested)
    this.rig.controls.dispose()
    disposeScene(this.scene, this.renderer)
  }

  private request(): void {
    this.requested ||= requestAnimationFrame(() => {
      this.requested = 0
      this.render()
    })
  }
}

function placeOf({ values, error, current, limit }: Layer, i: number, k: number): Vector3 {
  const along = (index: number, count: number) => (2 * index) / (count - 1) - 1
  return new Vector3(
    along(i, error.values.length) * HALF.error,
    along(k, current.values.length) * HALF.current,
    limit > 0 ? (values[i][k] / limit) * HALF.value : 0,
  )
}

function surfaceOf(layer: Layer): Mesh {
  const [columns, rows] = [layer.error.values.length, layer.current.values.length]
  const theme = currentTheme()
  const positions = new Float32Array(3 * columns * rows)
  const colours = new Float32Array(3 * columns * rows)
  const faces: number[] = []
  const colour = new Color()
  for (let i = 0; i < columns; i++) {
    for (let k = 0; k < rows; k++) {
      const at = i * rows + k
      placeOf(layer, i, k).toArray(positions, 3 * at)
      const share = layer.limit > 0 ? layer.values[i][k] / layer.limit : 0
      const [r, g, b] = diverging(share, theme)
      colour.setRGB(r / 255, g / 255, b / 255, SRGBColorSpace).toArray(colours, 3 * at)
      if (i + 1 < columns && k + 1 < rows) {
        faces.push(at, at + rows, at + 1, at + rows, at + rows + 1, at + 1)
      }
    }
  }
  const geometry = new BufferGeometry()
  geometry.setAttribute('position', new BufferAttribute(positions, 3))
  geometry.setAttribute('color', new BufferAttribute(colours, 3))
  geometry.setIndex(faces)
  geometry.computeVertexNormals()
  const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide })
  // The grid lines lie on the surface.
  material.polygonOffset = true
  material.polygonOffsetFactor = 1
  material.polygonOffsetUnits = 1
  return new Mesh(geometry, material)
}

function netOf(layer: Layer, theme: 'light' | 'dark'): LineSegments {
  const [columns, rows] = [layer.error.values.length, layer.current.values.length]
  const points: Vector3[] = []
  const every = (count: number) => Math.max(1, Math.round((count - 1) / NET))
  for (let i = 0; i < columns; i += every(columns)) {
    for (let k = 0; k + 1 < rows; k++) {
      points.push(placeOf(layer, i, k), placeOf(layer, i, k + 1))
    }
  }
  for (let k = 0; k < rows; k += every(rows)) {
    for (let i = 0; i + 1 < columns; i++) {
      points.push(placeOf(layer, i, k), placeOf(layer, i + 1, k))
    }
  }
  const material = new LineBasicMaterial({ color: theme === 'dark' ? '#dfe7ea' : '#1b262c' })
  material.transparent = true
  material.opacity = 0.3
  return new LineSegments(new BufferGeometry().setFromPoints(points), material)
}

/** The box's floor, its back edges, and the zero level. */
function frameOf(colour: Color): LineSegments {
  const { error: x, current: y, value: z } = HALF
  const corner = (a: number, b: number, c: number) => new Vector3(a * x, b * y, c * z)
  const pairs = [-1, 0].flatMap((level) => [
    [corner(-1, -1, level), corner(1, -1, level)],
    [corner(1, -1, level), corner(1, 1, level)],
    [corner(1, 1, level), corner(-1, 1, level)],
    [corner(-1, 1, level), corner(-1, -1, level)],
  ])
  const posts = [
    [corner(-1, 1, -1), corner(-1, 1, 1)],
    [corner(1, 1, -1), corner(1, 1, 1)],
    [corner(1, -1, -1), corner(1, -1, 1)],
  ]
  const geometry = new BufferGeometry().setFromPoints([...pairs, ...posts].flat())
  return new LineSegments(geometry, new LineBasicMaterial({ color: colour }))
}

function labelsOf({ error, current, limit }: Layer, colour: string) {
  const { error: x, current: y, value: z } = HALF
  const number = (value: number) => formatExact(value, 4)
  const at: [text: string, place: Vector3][] = [
    [number(error.range[0]), new Vector3(-x, -y - 0.1, -z - 0.03)],
    [withUnit(error.name, error.unit), new Vector3(0, -y - 0.14, -z - 0.06)],
    [number(error.range[1]), new Vector3(x, -y - 0.1, -z - 0.03)],
    [number(current.range[0]), new Vector3(-x - 0.12, -y, -z)],
    [withUnit(current.name, current.unit), new Vector3(-x - 0.26, -0.1, -z - 0.03)],
    [number(current.range[1]), new Vector3(-x - 0.14, y, -z)],
    [formatNumber(limit, 3), new Vector3(x + 0.12, -y, z)],
    ['0', new Vector3(x + 0.08, -y, 0)],
    [formatNumber(-limit, 3), new Vector3(x + 0.13, -y, -z + 0.05)],
  ]
  return at.map(([text, place]) => {
    const label = facingText(text, colour, TEXT)
    label.position.copy(place)
    return label
  })
}
