/** Path of the body. */

import { BufferAttribute, BufferGeometry, type Color, Line, LineBasicMaterial } from 'three'
import type { Replay } from '../replay/replay'

export class Trail {
  readonly object: Line<BufferGeometry, LineBasicMaterial>

  constructor(private readonly replay: Replay) {
    const points = new Float32Array(3 * replay.frames)
    for (let frame = 0; frame < replay.frames; frame++) {
      for (let i = 0; i < 3; i++) points[3 * frame + i] = replay.value('link_pose', frame, i)
    }
    const geometry = new BufferGeometry()
    geometry.setAttribute('position', new BufferAttribute(points, 3))
    this.object = new Line(geometry, new LineBasicMaterial())
    // The drawn range changes, and so would the bounds.
    this.object.frustumCulled = false
  }

  show(time: number): void {
    this.object.geometry.setDrawRange(0, this.replay.frameAt(time) + 1)
  }

  recolour(colour: Color): void {
    this.object.material.color.copy(colour)
  }
}
