/** Ground plane with a labelled grid that fades into the distance, and uneven ground above it. */

import {
  BufferAttribute,
  BufferGeometry,
  Group,
  Mesh,
  MeshLambertMaterial,
  PlaneGeometry,
  ShaderMaterial,
  ShadowMaterial,
  Vector2,
} from 'three'
import type { Extent } from '../replay/extent'
import type { Replay } from '../replay/replay'
import { lyingText } from './label'
import type { Palette } from './palette'
import { disposeTree } from './renderer'

/** Edge of the plane, which moves with the robot, in spans. */
const EDGE = 45

/** Cells between thick, labelled lines, and the largest number of labels. */
const LABEL_EVERY = 5
const MOST_LABELS = 40

/** Height of labels, and their elevation above the ground, in spans. */
const TEXT = 0.095
const LIFT = 0.004

/** Distances between which the grid fades, in spans. */
const FADES = [1.7, 8.5] as const

const VERTEX = `
varying vec2 place;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = position.xy + origin;
  gl_Position = projectionMatrix * viewMatrix * world;
}`

// Lines are one pixel wide at any distance; they fade out where they would flicker.
const FRAGMENT = `
uniform vec3 ground;
uniform vec3 background;
uniform vec3 cell;
uniform vec3 metre;
uniform vec2 origin;
uniform float size;
uniform vec2 fades;
varying vec2 place;

float grid(vec2 p, float size, float width) {
  vec2 q = p / size;
  vec2 slope = fwidth(q);
  vec2 near = abs(fract(q - 0.5) - 0.5) / slope;
  vec2 lines = 1.0 - min(near / width, 1.0);
  lines *= 1.0 - smoothstep(0.15, 0.5, slope);
  return max(lines.x, lines.y);
}

void main() {
  vec3 colour = mix(ground, cell, grid(place, size, 1.1));
  colour = mix(colour, metre, grid(place, 5.0 * size, 1.5));
  float far = smoothstep(fades.x, fades.y, distance(place, origin));
  gl_FragColor = vec4(mix(colour, background, far), 1.0);
  #include <colorspace_fragment>
}`

type Heights = NonNullable<Replay['header']['ground']['heights']>

/** Uneven ground as triangles. */
export function heightMesh({ x, y, z }: Heights): Mesh<BufferGeometry, MeshLambertMaterial> {
  const places = x.flatMap((along, i) => y.flatMap((across, j) => [along, across, z[i][j]]))
  const corners: number[] = []
  for (let i = 0; i + 1 < x.length; i++) {
    for (let j = 0; j + 1 < y.length; j++) {
      const [near, far] = [i * y.length + j, (i + 1) * y.length + j]
      corners.push(near, far, near + 1, near + 1, far, far + 1)
    }
  }
  const geometry = new BufferGeometry()
  geometry.setAttribute('position', new BufferAttribute(Float32Array.from(places), 3))
  geometry.setIndex(corners)
  geometry.computeVertexNormals()
  const mesh = new Mesh(geometry, new MeshLambertMaterial())
  mesh.receiveShadow = true
  return mesh
}

export class Ground {
  readonly object = new Group()
  private readonly plane: Mesh<PlaneGeometry, ShaderMaterial>
  private readonly shade: Mesh<PlaneGeometry, ShadowMaterial>
  private labels = new Group()
  private readonly uneven: ReturnType<typeof heightMesh> | null
  /** Height of the plane, below uneven ground [m]. */
  private readonly floor: number

  constructor(
    /** Largest distance walked [m]. */
    private readonly length: number,
    /** Lateral position of the labels [m]. */
    private readonly labelOffset: number,
    private readonly extent: Extent,
    shadows: boolean,
    heights?: Heights | null,
  ) {
    const edge = EDGE * extent.span
    const material = new ShaderMaterial({
      vertexShader: `uniform vec2 origin;${VERTEX}`,
      fragmentShader: FRAGMENT,
      uniforms: {
        ground: { value: null },
        background: { value: null },
        cell: { value: null },
        metre: { value: null },
        origin: { value: new Vector2() },
        size: { value: extent.cell },
        fades: { value: new Vector2(...FADES).multiplyScalar(extent.span) },
      },
    })
    this.plane = new Mesh(new PlaneGeometry(edge, edge), material)
    this.plane.renderOrder = -2
    this.shade = new Mesh(new PlaneGeometry(edge, edge), new ShadowMaterial())
    const levels = heights?.z.flat() ?? [0]
    this.floor = Math.min(0, ...levels)
    this.labels.position.z = Math.max(0, ...levels)
    this.moveTo(0, 0)
    this.shade.receiveShadow = true
    this.shade.visible = shadows && !heights
    this.object.add(this.plane, this.shade, this.labels)
    this.uneven = heights ? heightMesh(heights) : null
    if (this.uneven) this.object.add(this.uneven)
  }

  recolour(colours: Palette): void {
    const { uniforms } = this.plane.material
    for (const name of ['ground', 'background', 'cell', 'metre'] as const) {
      uniforms[name].value = colours[name]
    }
    this.shade.material.opacity = colours.shadow
    this.uneven?.material.color.copy(colours.ground)
    this.relabel(colours.text)
  }

  /** Keep the plane under the robot; its grid stays fixed. */
  moveTo(x: number, y: number): void {
    this.plane.position.set(x, y, this.floor)
    this.shade.position.set(x, y, 0.5 * LIFT * this.extent.span)
    this.plane.material.uniforms.origin.value.set(x, y)
  }

  private relabel(colour: string): void {
    disposeTree(this.labels)
    this.labels.clear()
    const { cell, span } = this.extent
    const every = LABEL_EVERY * cell
    const digits = Math.max(1, Math.ceil(-Math.log10(every)))
    const count = Math.min(MOST_LABELS, Math.ceil(this.length / every) + 1)
    for (let k = 0; k <= count; k++) {
      const label = lyingText(`${(k * every).toFixed(digits)} m`, colour, TEXT * span)
      label.position.set(k * every, this.labelOffset, LIFT * span)
      this.labels.add(label)
    }
  }
}
