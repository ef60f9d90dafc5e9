/** Example replays: a box with one leg that slides along x. */

import type { Channel, ReplayHeader } from '../../../src/walk/replay/replay'

export const CHANNELS: Channel[] = [
  { name: 'time', unit: 's', description: '', shape: [1], offset: 0, labels: [] },
  { name: 'link_pose', unit: 'm, 1', description: '', shape: [1, 7], offset: 1, labels: ['body'] },
  { name: 'foot_position', unit: 'm', description: '', shape: [1, 3], offset: 8, labels: ['leg'] },
  { name: 'foot_force', unit: 'N', description: '', shape: [1, 3], offset: 11, labels: ['leg'] },
]

const STRIDE = 14

/** Frames at 10 Hz; the body is at x = time and rotates about z by a quarter turn per second. */
export function frames(count: number): Float32Array {
  const values = new Float32Array(count * STRIDE)
  for (let frame = 0; frame < count; frame++) {
    const time = frame / 10
    const half = (Math.PI / 4) * time
    values.set([time, time, 0, 0.15, 0, 0, Math.sin(half), Math.cos(half)], frame * STRIDE)
    values.set([time, 0.2, 0, 0, 0, 10 * frame], frame * STRIDE + 8)
  }
  return values
}

export function header(count: number, changes: Partial<ReplayHeader> = {}): ReplayHeader {
  return {
    version: 1,
    rate: 10,
    frames: count,
    duration: count / 10,
    status: 'ok',
    explanation: 'walked to the end',
    objectives: { torque: 8.7 },
    objective_units: { torque: 'N m' },
    scenario: { name: 'normal-fast' } as ReplayHeader['scenario'],
    robot: {
      name: 'box',
      urdf: null,
      links: [{ name: 'body', parent: null, shapes: [], meshes: [] }],
      joints: ['leg_coxa'],
      legs: ['leg'],
      mass: 2,
      torque_limits: [3],
      current_limits: [5],
    },
    ground: { slope_deg: 0, slope_direction_deg: 0, normal: [0, 0, 1], heights: null },
    gravity: [0, 0, -9.81],
    load_kg: 0,
    channels: CHANNELS,
    ...changes,
  }
}

/** Encode like the server. padding: whether the header is padded to whole words. */
export function encoded(head: object, values: Float32Array, padding = true): ArrayBuffer {
  let text = new TextEncoder().encode(JSON.stringify(head))
  if (padding) {
    const padded = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(32)
    padded.set(text)
    text = padded
  }
  const bytes = new ArrayBuffer(4 + text.length + 4 * values.length)
  new DataView(bytes).setUint32(0, text.length, true)
  new Uint8Array(bytes).set(text, 4)
  const view = new DataView(bytes, 4 + text.length)
  for (const [k, value] of values.entries()) view.setFloat32(4 * k, value, true)
  return bytes
}
