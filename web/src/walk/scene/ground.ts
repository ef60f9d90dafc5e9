/** The ground: a plane with a grid of ten centimetres, which fades into the distance. */

import {
  Group,
  Mesh,
  type MeshBasicMaterial,
  PlaneGeometry,
  ShaderMaterial,
  ShadowMaterial,
  Vector2,
} from 'three'
import { lyingText } from './label'
import type { Palette } from './palette'

/** Edge of the plane [m]; it is moved along with the robot. */
const EDGE = 24

/** Distance between labels [m], and how far they are drawn at most. */
const LABEL_EVERY = 0.5
const MOST_LABELS = 40

const VERTEX = `
varying vec2 place;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = position.xy + origin;
  gl_Position = projectionMatrix * viewMatrix * world;
}`

// Lines are as wide as a pixel wherever they are; fine ones vanish where they would flicker.
const FRAGMENT = `
uniform vec3 ground;
uniform vec3 background;
uniform vec3 cell;
uniform vec3 metre;
uniform vec2 centre;
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
  vec3 colour = mix(ground, cell, grid(place, 0.1, 1.1));
  colour = mix(colour, metre, grid(place, 0.5, 1.5));
  float far = smoothstep(0.9, 4.5, distance(place, centre));
  gl_FragColor = vec4(mix(colour, background, far), 1.0);
  #include <colorspace_fragment>
}`

export class Ground {
  readonly object = new Group()
  private readonly plane: Mesh<PlaneGeometry, ShaderMaterial>
  private readonly shade: Mesh<PlaneGeometry, ShadowMaterial>
  private labels = new Group()

  constructor(
    /** Furthest distance walked [m]. */
    private readonly length: number,
    /** Where the labels stand, across the way [m]. */
    private readonly beside: number,
    shadows: boolean,
  ) {
    const material = new ShaderMaterial({
      vertexShader: `uniform vec2 origin;${VERTEX}`,
      fragmentShader: FRAGMENT,
      uniforms: {
        ground: { value: null },
        background: { value: null },
        cell: { value: null },
        metre: { value: null },
        origin: { value: new Vector2() },
        centre: { value: new Vector2() },
      },
    })
    this.plane = new Mesh(new PlaneGeometry(EDGE, EDGE), material)
    this.plane.renderOrder = -2
    this.shade = new Mesh(new PlaneGeometry(EDGE, EDGE), new ShadowMaterial())
    this.shade.position.z = 0.001
    this.shade.receiveShadow = true
    this.shade.visible = shadows
    this.object.add(this.plane, this.shade, this.labels)
  }

  recolour(colours: Palette): void {
    const { uniforms } = this.plane.material
    uniforms.ground.value = colours.ground
    uniforms.background.value = colours.background
    uniforms.cell.value = colours.cell
    uniforms.metre.value = colours.metre
    this.shade.material.opacity = colours.shadow
    this.relabel(colours.text)
  }

  /** Keep the plane under the robot; its lines stay where they are. */
  moveTo(x: number, y: number): void {
    this.plane.position.set(x, y, 0)
    this.shade.position.set(x, y, 0.001)
    const { origin, centre } = this.plane.material.uniforms
    origin.value.set(x, y)
    centre.value.set(x, y)
  }

  private relabel(colour: string): void {
    for (const label of this.labels.children as Mesh<PlaneGeometry, MeshBasicMaterial>[]) {
      label.material.map?.dispose()
      label.material.dispose()
      label.geometry.dispose()
    }
    this.labels.clear()
    const count = Math.min(MOST_LABELS, Math.ceil(this.length / LABEL_EVERY) + 1)
    for (let k = 0; k <= count; k++) {
      const label = lyingText(`${(k * LABEL_EVERY).toFixed(1)} m`, colour, 0.05)
      label.position.set(k * LABEL_EVERY, this.beside, 0.002)
      this.labels.add(label)
    }
  }
}
