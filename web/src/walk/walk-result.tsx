/** Outcome and objectives of walks. */

import { Card } from '../components/card'
import { type Column, Table } from '../components/table/table'
import { Unit } from '../components/text'
import { change, formatNumber, NONE } from '../format/number'
import { inWords, sentence } from '../format/words'
import { amountOf, type Quantity, quantityOf } from '../job/quantity'
import type { Recorded, Replay } from './replay/replay'

const MEANINGS: Readonly<Record<string, string>> = {
  torque: 'rms of the summed gear torques',
  acceleration: "rms of the body's acceleration",
  angular_acceleration: "rms of the body's angular acceleration",
  energy: 'electrical energy per metre',
  speed: 'mean forward speed',
  height_loss: "body's height at the start minus that at the end",
}

export function FailureNotices({ walks }: { walks: readonly Recorded[] }) {
  const failed = walks.filter(({ replay }) => replay.header.status !== 'ok')
  return failed.map(({ label, replay }) => (
    <div
      class="notice"
      data-tone="bad"
      role="status"
      data-status={replay.header.status}
      key={label}
    >
      <strong>
        {label}: {replay.header.status} after {replay.header.duration.toFixed(2)}&nbsp;s.
      </strong>
      <p>
        {sentence(replay.header.explanation)} {extentOf(replay)}
      </p>
    </div>
  ))
}

export function ObjectivesTable({ walks }: { walks: readonly Recorded[] }) {
  const { objectives, objective_units } = walks[0].replay.header
  const amount = (shown: Quantity, k: number) => amountOf(walks[k]?.replay.header, shown)
  const comparing = walks.length > 1
  const columns: Column<Quantity>[] = [
    {
      key: 'objective',
      header: true,
      cell: ({ name, unit }) => (
        <>
          {inWords(name)}
          <Unit unit={unit} />
          <span class="muted small block">{MEANINGS[name]}</span>
        </>
      ),
    },
    ...walks.map(({ label }, k) => ({
      key: `walk-${k}`,
      label: comparing ? label : 'Value',
      numeric: true,
      cell: (shown: Quantity) => formatNumber(amount(shown, k)),
    })),
    {
      key: 'difference',
      label: `vs. ${walks[1]?.label}`,
      numeric: true,
      cell: (shown) => difference(shown.unit, amount(shown, 0), amount(shown, 1)),
    },
  ]
  return (
    <Card title="Objectives" note="Lower is better, except for the speed.">
      <Table
        caption="Objectives of the walk"
        rows={Object.keys(objectives).map((name) =>
          quantityOf({ name, unit: objective_units[name] }),
        )}
        columns={comparing ? columns : columns.slice(0, -1)}
      />
    </Card>
  )
}

/** From the baseline, in percent, or in the objective's unit if it can be negative. */
function difference(unit: string, value: number | null, baseline: number | null): string {
  if (value === null || baseline === null) return NONE
  return value > 0 && baseline > 0
    ? change(100 * (value / baseline - 1), '%')
    : change(value - baseline, unit)
}

/** How much of a failed walk can be shown. */
function extentOf({ frames, header }: Replay): string {
  if (frames === 0) return 'There is nothing to show.'
  const { cycles, cycle_time } = header.scenario
  return header.duration < cycles * cycle_time - 0.01 ? 'Shown up to that point.' : 'Shown in full.'
}
