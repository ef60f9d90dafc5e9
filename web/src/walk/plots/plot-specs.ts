/** Charts of a walk and their curves. */

import type { Replay } from '../replay/replay'

/** One component of a channel over time. */
export interface Curve {
  readonly label: string
  readonly channel: string
  readonly index: number
  readonly colour: `--${string}`
  /** Thin line, for desired values. */
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

/** All charts of a walk, joint charts for one leg. Charts of missing channels are omitted. */
export function plotSpecs(replay: Replay, leg: number): PlotSpec[] {
  const { legs } = replay.header.robot
  const name = words(legs[leg])
  const specs: PlotSpec[] = [
    {
      key: 'angles',
      title: `Joint angles, ${name}`,
      note: 'Thin: desired. Thick: actual.',
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
      note: 'Torque of each gear on its joint.',
      quantity: 'torque',
      unit: 'N m',
      curves: ofJoints(replay, leg).map((curve) => ({ ...curve, channel: 'load_torque' })),
    },
    {
      key: 'acceleration',
      title: 'Acceleration of the body',
      note: "In the body's frame: x forward, y left, z up; without gravity.",
      quantity: 'acceleration',
      unit: 'm/s²',
      curves: ofAxes('body_acceleration', 0),
    },
    {
      key: 'leg-force',
      title: `Ground reaction force, ${name}`,
      note: 'x forward along the ground, y left, z normal to the ground.',
      quantity: 'force',
      unit: 'N',
      curves: ofAxes('foot_force', 3 * leg),
    },
    {
      key: 'normal-forces',
      title: 'Ground reaction force, all feet',
      note: 'Normal component.',
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
      title: 'Battery voltage',
      note: 'Under the load of all motors.',
      quantity: 'voltage',
      unit: 'V',
      curves: [{ label: 'supply', channel: 'supply', index: 0, colour: '--series-1' }],
    },
  ]
  return specs.filter(({ curves }) => curves.every(({ channel }) => replay.channel(channel)))
}

/** Readable form of a name: right_front is right front. */
export function words(name: string): string {
  return name.replaceAll('_', ' ')
}

// A leg's joints start with its name.
function ofJoints(replay: Replay, leg: number): Omit<Curve & { channel: string }, 'thin'>[] {
  const { joints, legs } = replay.header.robot
  const prefix = `${legs[leg]}_`
  const ofLeg = joints.flatMap((joint, index) => (joint.startsWith(prefix) ? [index] : []))
  const shown = ofLeg.length > 0 ? ofLeg : joints.map((_, index) => index)
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
