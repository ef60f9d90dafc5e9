/** Replay format of `POST /v1/replays`: a JSON header, then float32 values by frame. */

import { postBytes } from '../../api/client'
import type { components } from '../../api/schema'
import type { Scenario } from '../../api/types'
import type { ResolvedDesign } from '../design/resolve-design'

type Schemas = components['schemas']

export type ReplayHeader = Schemas['ReplayHeaderView']
export type Shape = Schemas['Shape']
export type LinkMesh = Schemas['VisualMesh']
export type Channel = Schemas['ChannelView']

const REPLAY_VERSION = 1

/** Required channels; charts of other missing channels are omitted. */
const REQUIRED = ['time', 'link_pose', 'foot_position', 'foot_force'] as const

/** Invalid data, or another version of the format. */
export class ReplayFormatError extends Error {
  override readonly name = 'ReplayFormatError'
}

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

  column(name: string, index: number): Float32Array {
    const column = new Float32Array(this.frames)
    for (let frame = 0; frame < this.frames; frame++) column[frame] = this.value(name, frame, index)
    return column
  }

  /** Size of a foot's force in a frame [N]. */
  force(frame: number, leg: number): number {
    return Math.hypot(...[0, 1, 2].map((i) => this.value('foot_force', frame, 3 * leg + i)))
  }

  /** Sizes of all forces of the feet in all frames [N]. */
  forces(): Float32Array {
    const legs = this.header.robot.legs.length
    return Float32Array.from({ length: legs * this.frames }, (_, k) =>
      this.force(Math.floor(k / legs), k % legs),
    )
  }

  /** Values of a channel at a time [s], linear between frames, clamped to the walk. */
  sample(name: string, time: number, out: Float32Array): void {
    const { a, b, share } = this.around(name, time)
    for (let i = 0; i < out.length; i++) {
      out[i] = this.values[a + i] * (1 - share) + this.values[b + i] * share
    }
  }

  /** Offsets of a channel in the frames around a time [s], and its position between them, 0 to 1. */
  around(name: string, time: number): { a: number; b: number; share: number } {
    const frame = this.frameAt(time)
    const next = Math.min(frame + 1, this.frames - 1)
    const [from, to] = [this.time(frame), this.time(next)]
    const share = to > from ? Math.min(1, Math.max(0, (time - from) / (to - from))) : 0
    const offset = this.channels.get(name)?.offset ?? 0
    return { a: frame * this.stride + offset, b: next * this.stride + offset, share }
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

export function hasMeshes({ robot }: ReplayHeader): boolean {
  return robot.urdf !== null && robot.links.some(({ meshes }) => meshes.length > 0)
}

/** Decode a replay. Throws ReplayFormatError. */
export function parseReplay(bytes: ArrayBuffer): Replay {
  const check = (valid: boolean, message: string) => {
    if (!valid) throw new ReplayFormatError(message)
  }
  check(bytes.byteLength >= 4, 'the replay is empty; try again')
  const start = 4 + new DataView(bytes).getUint32(0, true)
  check(start <= bytes.byteLength, 'the replay is truncated; try again')
  const header = parseHeader(new TextDecoder().decode(new Uint8Array(bytes, 4, start - 4)))
  check(
    header.version === REPLAY_VERSION,
    `the replay has version ${header.version}, expected ${REPLAY_VERSION}; reload the page`,
  )
  const expected = header.frames * widthOf(header.channels) * 4
  const actual = bytes.byteLength - start
  check(
    actual === expected,
    `the replay has ${actual} bytes of frames instead of ${expected}; try again`,
  )
  const sizes = new Map(header.channels.map((channel) => [channel.name, sizeOf(channel)]))
  for (const name of REQUIRED) check(sizes.has(name), `the replay has no channel ${name}`)
  check(
    sizes.get('link_pose') === header.robot.links.length * 7,
    'the replay does not have one pose per link',
  )
  // Floats must be aligned; their byte order is that of every browser.
  return new Replay(
    header,
    start % 4 === 0 ? new Float32Array(bytes, start) : new Float32Array(bytes.slice(start)),
  )
}

function parseHeader(text: string): ReplayHeader {
  try {
    return JSON.parse(text)
  } catch {
    throw new ReplayFormatError('the header of the replay is not JSON; try again')
  }
}

function sizeOf({ shape }: Channel): number {
  return shape.reduce((product, n) => product * n, 1)
}

function widthOf(channels: readonly Channel[]): number {
  return Math.max(0, ...channels.map((channel) => channel.offset + sizeOf(channel)))
}

/** Contact force threshold of a stance [N]. */
export const CONTACT_FORCE = 0.5

/** Stance phases of a foot [s]. */
export function stances(replay: Replay, leg: number): (readonly [from: number, to: number])[] {
  const spans: (readonly [number, number])[] = []
  let from: number | null = null
  for (let frame = 0; frame < replay.frames; frame++) {
    const stands = replay.force(frame, leg) > CONTACT_FORCE
    if (stands && from === null) from = replay.time(frame)
    if (!stands && from !== null) {
      spans.push([from, replay.time(frame)])
      from = null
    }
  }
  if (from !== null) spans.push([from, replay.end])
  return spans
}

export type WalkingDesign = Pick<ResolvedDesign, 'label' | 'robot' | 'design' | 'world'> & {
  readonly controller: { readonly name: string }
}

export interface Recorded {
  readonly label: string
  readonly replay: Replay
}

/** Recording rates [Hz]: for the eye, the charts, the controller. */
export const RATES = [50, 100, 500] as const

export const DEFAULT_RATE = 100

/** Simulate a design in a scenario, given by preset name or in full. */
export async function recordWalk(
  { label, robot, controller, design, world = {} }: WalkingDesign,
  scenario: string | Scenario,
  rate: number,
  signal: AbortSignal,
): Promise<Recorded> {
  const name = controller.name as 'fuzzy-pi'
  const body = {
    robot,
    controller: name,
    design: { ...design },
    world: { ...world },
    scenario,
    rate,
  }
  return { label, replay: parseReplay(await postBytes('/v1/replays', { body, signal })) }
}
