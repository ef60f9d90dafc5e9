/** Which curves belong into which chart of a walk. Pure. */

import type { Replay } from '../replay/replay'

/** A curve: one number of a channel over time. */
export interface Curve {
  readonly label: string
  readonly channel: string
  readonly index: number
  readonly colour: `--${string}`
  /** Drawn thin, as what is asked for beside what is reached. */
  readonly thin?: boolean
}

export interface PlotSpec {
  readonly key: string
  readonly title: string
  readonly note: string
  readonly quantity: string
  readonly unit: string
  readonly curves: readonly Curve[]
}

const COLOURS = [
  '--series-1',
  '--series-2',
  '--series-3',
  '--series-4',
  '--series-5',
  '--series-6',
] as const

/** All charts of a walk, those of joints for one leg. Channels that are missing are left out. */
export function plotSpecs(replay: Replay, leg: number): PlotSpec[] {
  const { legs } = replay.header.robot
  const name = words(legs[leg])
  const specs: PlotSpec[] = [
    {
      key: 'angles',
      title: `Joint angles, ${name}`,
      note: 'Thin: desired. Thick: reached.',
      quantity: 'angle',
      unit: 'rad',
      curves: ofJoints(replay, leg).flatMap(({ label, index, colour }) => [
        { label: `${label} desired`, channel: 'desired_angle', index, colour, thin: true },
        { label, channel: 'joint_angle', index, colour },
      ]),
    },
    {
      key: 'currents',
      title: `Motor currents, ${name}`,
      note: 'Of each motor of the leg.',
      quantity: 'current',
      unit: 'A',
      curves: ofJoints(replay, leg).map((curve) => ({ ...curve, channel: 'current' })),
    },
    {
      key: 'torques',
      title: `Gear torques, ${name}`,
      note: 'What each gear puts on its joint.',
      quantity: 'torque',
      unit: 'N m',
      curves: ofJoints(replay, leg).map((curve) => ({ ...curve, channel: 'load_torque' })),
    },
    {
      key: 'acceleration',
      title: 'Acceleration of the body',
      note: "In the body's frame: x ahead, y left, z up; without gravity.",
      quantity: 'acceleration',
      unit: 'm/s²',
      curves: ofAxes('body_acceleration', 0),
    },
    {
      key: 'leg-force',
      title: `Force of the ground, ${name}`,
      note: 'x along the ground ahead, y to the left, z away from it.',
      quantity: 'force',
      unit: 'N',
      curves: ofAxes('foot_force', 3 * leg),
    },
    {
      key: 'normal-forces',
      title: 'Force of the ground, all feet',
      note: 'Its part away from the ground.',
      quantity: 'normal force',
      unit: 'N',
      curves: legs.map((each, k) => ({
        label: words(each),
        channel: 'foot_force',
        index: 3 * k + 2,
        colour: COLOURS[k % COLOURS.length],
      })),
    },
    {
      key: 'supply',
      title: 'Voltage of the battery',
      note: 'Under the load of all motors.',
      quantity: 'voltage',
      unit: 'V',
      curves: [{ label: 'supply', channel: 'supply', index: 0, colour: '--series-1' }],
    },
  ]
  return specs.filter(({ curves }) => curves.every(({ channel }) => replay.channel(channel)))
}

/** A name of the robot's description as words: right_front is right front. */
export function words(name: string): string {
  return name.replaceAll('_', ' ')
}

/** The leg's joints are those that bear its name. */
function ofJoints(replay: Replay, leg: number): Omit<Curve & { channel: string }, 'thin'>[] {
  const { joints, legs } = replay.header.robot
  const prefix = `${legs[leg]}_`
  const own = joints.flatMap((joint, index) => (joint.startsWith(prefix) ? [index] : []))
  const shown = own.length > 0 ? own : joints.map((_, index) => index)
  return shown.map((index, k) => ({
    label: words(joints[index].replace(prefix, '')),
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
