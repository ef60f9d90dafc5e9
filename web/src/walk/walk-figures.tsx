/** Figures of a walk that people know, compared with a baseline if there is one. */

import { formatNumber, percent, quantity } from '../format/number'
import { amountOf, MARKS } from '../job/quantity'
import type { Recorded, Replay } from './replay/replay'
import { peakOf, slipPerMetre } from './replay/support'

type Figure = readonly [label: string, unit: string, value: number | null, note?: string | null]

function figuresOf(replay: Replay): readonly Figure[] {
  const { objectives, robot, gravity, load_kg } = replay.header
  const { energy } = objectives
  const weight = (robot.mass + load_kg) * Math.hypot(...gravity)
  const current = peakOf(replay, 'current', robot.current_limits)
  const torque = peakOf(replay, 'load_torque', robot.torque_limits)
  const ofLimit = (peak: typeof current, limit: string) =>
    peak && `${percent(peak.share, 2)} of ${limit}`
  return [
    ['Speed', 'm/s', amountOf({ objectives }, { name: 'speed' })],
    ['Cost of transport', '1', energy && energy / weight],
    ['Peak current', 'A', current && current.peak, ofLimit(current, 'stall')],
    ['Peak gear torque', 'N m', torque && torque.peak, ofLimit(torque, 'nominal')],
    ['Slip', 'm/m', slipPerMetre(replay)],
  ]
}

/** walks: the walk, and the baseline that it is compared with. */
export function WalkFigures({ walks }: { walks: readonly Recorded[] }) {
  const [figures, baseline] = walks.map(({ replay }) => figuresOf(replay))
  return (
    <dl class="card walk-figures" data-figures>
      {figures.map(([label, unit, value, note], k) => (
        <div key={label}>
          <dt>{label}</dt>
          <dd>{quantity(value, unit, 3)}</dd>
          {note && <dd class="muted small">{note}</dd>}
          {baseline && (
            <Change value={value} from={baseline[k][2]} more={label === 'Speed'} unit={unit} />
          )}
        </div>
      ))}
    </dl>
  )
}

interface ChangeProps {
  value: number | null
  from: number | null
  /** Whether more is better. */
  more: boolean
  unit: string
}

function Change({ value, from, more, unit }: ChangeProps) {
  if (value === null || from === null || !(from > 0)) return null
  const relative = value / from - 1
  const same = Math.abs(relative) <= 0.005
  const tone = same ? 'same' : relative > 0 === more ? 'better' : 'worse'
  return (
    <dd class="judged" data-tone={tone}>
      <b>{MARKS[tone]}</b>{' '}
      {same
        ? 'the same as'
        : `${percent(Math.abs(relative), 2)} ${relative > 0 ? 'more' : 'less'} than`}{' '}
      {formatNumber(from, 3)}
      {unit === '1' ? '' : ` ${unit}`}
    </dd>
  )
}
