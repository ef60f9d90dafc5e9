/** Charts of a walk and their curves. */

import type { Series } from '../../charts/lines/line-chart'
import { inWords } from '../../format/words'
import type { Recorded, Replay } from '../replay/replay'
import { slipSpeed } from '../replay/support'

export interface Curve {
  readonly label: string
  readonly channel: string
  readonly index: number
  readonly colour: `--${string}`
  readonly thin?: boolean
  /** Derived value of a frame, in place of the channel's. */
  readonly of?: (replay: Replay, frame: number) => number
}

export interface PlotSpec {
  readonly title: string
  readonly note: string
  readonly quantity: string
  readonly unit: string
  readonly curves: readonly Curve[]
  /** Of the absolute value, by label; drawn where it lies within the chart. */
  readonly limits?: readonly { readonly label: string; readonly value: number }[]
}

const COLOURS = [
  '--series-1',
  '--series-2',
  '--series-3',
  '--series-4',
  '--series-5',
  '--series-6',
] as const

/** All charts of a walk, joint charts for one leg. Charts of missing channels are omitted. */
export function plotSpecs(replay: Replay, leg: number): PlotSpec[] {
  const { legs, torque_limits, current_limits } = replay.header.robot
  const name = inWords(legs[leg])
  const joints = ofJoints(replay, leg)
  const inBody = "In the body's frame: x forward, y left, z up; without gravity."
  const onGround = 'x forward along the ground, y left, z normal to the ground.'
  const angles = joints.flatMap(({ label, index, colour }) => [
    { label: `${label} desired`, channel: 'desired_angle', index, colour, thin: true },
    { label, channel: 'joint_angle', index, colour },
  ])
  const of = (channel: string) => joints.map((curve) => ({ ...curve, channel }))
  const normal = legs.map((each, k) => ({
    label: inWords(each),
    channel: 'foot_force',
    index: 3 * k + 2,
    colour: COLOURS[k % COLOURS.length],
  }))
  const supply = { label: 'supply', channel: 'supply', index: 0, colour: COLOURS[0] }
  const slips = legs.map((each, k) => ({
    label: inWords(each),
    channel: 'foot_force',
    index: 3 * k,
    colour: COLOURS[k % COLOURS.length],
    of: (walk: Replay, frame: number) => 1e3 * slipSpeed(walk, k, frame),
  }))
  const limits = (values: readonly number[]) =>
    joints.map(({ label, index }) => ({ label: `limit of ${label}`, value: values[index] }))
  type Row = readonly [
    title: string,
    note: string,
    quantity: string,
    unit: string,
    curves: Curve[],
    limits?: ReturnType<typeof limits>,
  ]
  const rows: readonly Row[] = [
    [`Joint angles, ${name}`, 'Thin: desired. Thick: actual.', 'angle', 'rad', angles],
    [
      `Motor currents, ${name}`,
      'Of each motor of the leg.',
      'current',
      'A',
      of('current'),
      limits(current_limits),
    ],
    [
      `Gear torques, ${name}`,
      'Torque of each gear on its joint.',
      'torque',
      'N m',
      of('load_torque'),
      limits(torque_limits),
    ],
    ['Slip of the feet', 'Speed on the ground while standing.', 'slip', 'mm/s', slips],
    ['Acceleration of the body', inBody, 'acceleration', 'm/s²', ofAxes('body_acceleration', 0)],
    [`Ground reaction force, ${name}`, onGround, 'force', 'N', ofAxes('foot_force', 3 * leg)],
    ['Ground reaction force, all feet', 'Normal component.', 'normal force', 'N', normal],
    ['Battery voltage', 'Under the load of all motors.', 'voltage', 'V', [supply]],
  ]
  return rows
    .filter(([, , , , curves]) => curves.every(({ channel }) => replay.channel(channel)))
    .map(([title, note, quantity, unit, curves, limits]) => ({
      title,
      note,
      quantity,
      unit,
      curves,
      limits,
    }))
}

// A leg's joints start with its name.
function ofJoints(replay: Replay, leg: number): Omit<Curve & { channel: string }, 'thin'>[] {
  const { joints, legs } = replay.header.robot
  const prefix = `${legs[leg]}_`
  const ofLeg = joints.flatMap((joint, index) => (joint.startsWith(prefix) ? [index] : []))
  const shown = ofLeg.length > 0 ? ofLeg : joints.map((_, index) => index)
  return shown.map((index, k) => ({
    label: inWords(joints[index].replace(prefix, '')),
    channel: 'joint_angle',
    index,
    colour: COLOURS[k % COLOURS.length],
  }))
}

function ofAxes(channel: string, first: number): Curve[] {
  return ['x', 'y', 'z'].map((label, k) => ({
    label,
    channel,
    index: first + k,
    colour: COLOURS[k],
  }))
}

/** Dash pattern of the second walk [px]. */
const DASH = [7, 4] as const

/** Times of the longest walk [s]; all have the same rate. */
export function moments(walks: readonly Recorded[]): Float32Array {
  const [longest] = walks.map(({ replay }) => replay).sort((a, b) => b.frames - a.frames)
  return longest.column('time', 0)
}

/** Curves of all walks, those of the second dashed; null after the end of a walk. */
export function seriesOf(curves: readonly Curve[], walks: readonly Recorded[]): Series[] {
  const length = Math.max(...walks.map(({ replay }) => replay.frames))
  return walks.flatMap(({ label, replay }, k) =>
    curves.map((curve) => ({
      label: k === 0 ? curve.label : `${curve.label}, ${label}`,
      values: valuesOf(replay, curve, length),
      colour: curve.colour,
      width: curve.thin ? 1 : 2,
      dash: k === 0 ? undefined : DASH,
    })),
  )
}

function valuesOf(replay: Replay, curve: Curve, length: number): (number | null)[] {
  const values: (number | null)[] = new Array(length).fill(null)
  for (let frame = 0; frame < replay.frames; frame++) {
    const value = curve.of?.(replay, frame) ?? replay.value(curve.channel, frame, curve.index)
    if (Number.isFinite(value)) values[frame] = value
  }
  return values
}
