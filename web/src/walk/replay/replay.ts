/** Replay format of `POST /v1/replays`: a JSON header, then float32 values by frame. */

import type { Scenario } from '../../api/types'

/** Supported version of the format. */
const REPLAY_VERSION = 1

type Solid = 'capsule' | 'box' | 'sphere' | 'cylinder'
export type Role = 'body' | 'coxa' | 'femur' | 'tibia' | 'foot' | 'load'

/** A solid attached to a link. */
export interface Shape {
  readonly type: Solid
  /** Box: edges; sphere: radius; cylinder and capsule: radius, length along z [m]. */
  readonly size: readonly number[]
  /** Centre in the link's frame: x y z [m], quaternion x y z w. */
  readonly origin: readonly number[]
  readonly role: Role
}

/** A mesh on a link, from the URDF. */
export interface LinkMesh {
  /** Name of its file. */
  readonly name: string
  /** In the link's frame: x y z [m], quaternion x y z w. */
  readonly origin: readonly number[]
  readonly scale: readonly number[]
  /** Red, green, blue, opacity, 0 to 1. */
  readonly colour: readonly number[] | null
}

interface Link {
  readonly name: string
  readonly parent: string | null
  readonly shapes: readonly Shape[]
  readonly meshes: readonly LinkMesh[]
}

/** A quantity recorded in every frame. */
export interface Channel {
  readonly name: string
  readonly unit: string
  readonly description: string
  readonly shape: readonly number[]
  /** Index of its first number in a frame. */
  readonly offset: number
  /** Names along the first axis. */
  readonly labels: readonly string[]
}

export interface ReplayHeader {
  readonly version: number
  readonly rate: number
  readonly frames: number
  readonly duration: number
  readonly status: string
  readonly explanation: string
  readonly objectives: Readonly<Record<string, number | null>>
  readonly objective_units: Readonly<Record<string, string>>
  readonly scenario: Scenario
  readonly robot: {
    readonly name: string
    /** SHA-256 of its URDF, which identifies its meshes; null for shipped robots. */
    readonly urdf: string | null
    readonly links: readonly Link[]
    readonly joints: readonly string[]
    readonly legs: readonly string[]
  }
  readonly ground: { readonly slope_deg: number; readonly slope_direction_deg: number }
  /** In the world's frame, whose z axis is normal to the ground [m/s2]. */
  readonly gravity: readonly [number, number, number]
  readonly load_kg: number
  readonly channels: readonly Channel[]
}

/** Required channels; charts of other missing channels are omitted. */
const REQUIRED = ['time', 'link_pose', 'foot_position', 'foot_force'] as const

/** Invalid data, or another version of the format. */
export class ReplayFormatError extends Error {
  override readonly name = 'ReplayFormatError'
}

/** A recorded walk. */
export class Replay {
  /** Numbers per frame. */
  readonly stride: number
  private readonly channels: ReadonlyMap<string, Channel>

  constructor(
    readonly header: ReplayHeader,
    readonly values: Float32Array,
  ) {
    this.stride = widthOf(header.channels)
    this.channels = new Map(header.channels.map((channel) => [channel.name, channel]))
  }

  get frames(): number {
    return this.header.frames
  }

  /** Time of the last frame [s]. */
  get end(): number {
    return this.frames === 0 ? 0 : this.time(this.frames - 1)
  }

  channel(name: string): Channel | undefined {
    return this.channels.get(name)
  }

  /** Time of a frame since the start [s]. */
  time(frame: number): number {
    return this.value('time', frame, 0)
  }

  /** One component of a channel; NaN for a missing channel. */
  value(name: string, frame: number, index: number): number {
    const channel = this.channels.get(name)
    return channel ? this.values[frame * this.stride + channel.offset + index] : Number.NaN
  }

  /** One component of a channel in all frames. */
  column(name: string, index: number): Float32Array {
    const column = new Float32Array(this.frames)
    for (let frame = 0; frame < this.frames; frame++) column[frame] = this.value(name, frame, index)
    return column
  }

  /** The last frame at or before a time [s]. */
  frameAt(time: number): number {
    let low = 0
    let high = this.frames - 1
    while (low < high) {
      const middle = (low + high + 1) >> 1
      if (this.time(middle) <= time + 1e-6) low = middle
      else high = middle - 1
    }
    return low
  }
}

/** Whether the robot's URDF refers to meshes. */
export function hasMeshes({ robot }: ReplayHeader): boolean {
  return robot.urdf !== null && robot.links.some(({ meshes }) => meshes.length > 0)
}

/** Numbers of a channel per frame. */
function sizeOf(channel: Channel): number {
  return channel.shape.reduce((product, n) => product * n, 1)
}

/** Decode a replay. Throws ReplayFormatError. */
export function parseReplay(bytes: ArrayBuffer): Replay {
  if (bytes.byteLength < 4) throw new ReplayFormatError('the replay is empty; try again')
  const length = new DataView(bytes).getUint32(0, true)
  const start = 4 + length
  if (start > bytes.byteLength) {
    throw new ReplayFormatError('the replay is truncated; try again')
  }
  const header = parseHeader(new TextDecoder().decode(new Uint8Array(bytes, 4, length)))
  const expected = header.frames * widthOf(header.channels) * 4
  const actual = bytes.byteLength - start
  if (actual !== expected) {
    throw new ReplayFormatError(
      `the replay has ${actual} bytes of frames instead of ${expected}; try again`,
    )
  }
  checkChannels(header)
  return new Replay(header, littleEndian(bytes, start))
}

function parseHeader(text: string): ReplayHeader {
  let header: ReplayHeader
  try {
    header = JSON.parse(text) as ReplayHeader
  } catch {
    throw new ReplayFormatError('the header of the replay is not JSON; try again')
  }
  if (header.version !== REPLAY_VERSION) {
    throw new ReplayFormatError(
      `the replay has version ${header.version}, expected ${REPLAY_VERSION}; reload the page`,
    )
  }
  return header
}

function checkChannels(header: ReplayHeader): void {
  const sizes = new Map(header.channels.map((channel) => [channel.name, sizeOf(channel)]))
  for (const name of REQUIRED) {
    if (!sizes.has(name)) throw new ReplayFormatError(`the replay has no channel ${name}`)
  }
  if (sizes.get('link_pose') !== header.robot.links.length * 7) {
    throw new ReplayFormatError('the replay does not have one pose per link')
  }
}

function widthOf(channels: readonly Channel[]): number {
  return channels.reduce((end, channel) => Math.max(end, channel.offset + sizeOf(channel)), 0)
}

/** Little-endian values from an offset; copied if alignment or byte order requires it. */
function littleEndian(bytes: ArrayBuffer, start: number): Float32Array {
  const native = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1
  if (native) {
    return start % 4 === 0 ? new Float32Array(bytes, start) : new Float32Array(bytes.slice(start))
  }
  const view = new DataView(bytes, start)
  return Float32Array.from({ length: view.byteLength / 4 }, (_, k) => view.getFloat32(4 * k, true))
}
