/** Outcome and objectives of walks. */

import { Table } from '../components/table/table'
import { Unit } from '../components/unit'
import { change, formatNumber, NONE } from '../format/number'
import { inWords, sentence } from '../format/words'
import type { Recorded } from './replay/recorded'
import type { Replay } from './replay/replay'

/** Descriptions of the objectives (table 4.1). */
const MEANINGS: Readonly<Record<string, string>> = {
  torque: 'rms of the summed gear torques',
  acceleration: "rms of the body's acceleration",
  angular_acceleration: "rms of the body's angular acceleration",
  energy: 'electrical energy per metre',
  reciprocal_speed: 'reciprocal of the mean speed',
  height_loss: "body's height at the start minus that at the end",
}

/** Notices for walks that did not finish. */
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

interface Row {
  readonly name: string
  readonly unit: string
  readonly values: readonly (number | null)[]
}

export function ObjectivesTable({ walks }: { walks: readonly Recorded[] }) {
  const { objectives, objective_units } = walks[0].replay.header
  const rows: Row[] = Object.keys(objectives).map((name) => ({
    name,
    unit: objective_units[name] ?? '1',
    values: walks.map(({ replay }) => replay.header.objectives[name] ?? null),
  }))
  const numbers = walks.map(({ label }, k) => ({
    key: `walk-${k}`,
    label: walks.length > 1 ? label : 'Value',
    numeric: true,
    cell: (row: Row) => formatNumber(row.values[k]),
  }))
  const compared = {
    key: 'difference',
    label: 'Second vs. first',
    numeric: true,
    cell: ({ unit, values: [first, second] }: Row) => difference(unit, first, second),
  }
  return (
    <section class={walks.length > 1 ? 'card wide' : 'card'} data-objectives>
      <header>
        <h2>Objectives</h2>
        <p class="muted small">Lower is better.</p>
      </header>
      <Table<Row>
        caption="Objectives of the walk"
        rows={rows}
        rowKey={(row) => row.name}
        columns={[
          {
            key: 'name',
            label: 'Objective',
            header: true,
            cell: ({ name, unit }) => (
              <>
                {inWords(name)}
                <Unit unit={unit} />
                <span class="muted small block">{MEANINGS[name]}</span>
              </>
            ),
          },
          ...numbers,
          ...(walks.length > 1 ? [compared] : []),
        ]}
      />
    </section>
  )
}

/** In percent, or in the objective's unit if it can be negative. */
function difference(unit: string, first: number | null, second: number | null): string {
  if (first === null || second === null) return NONE
  return first > 0 && second > 0
    ? change(100 * (second / first - 1), '%')
    : change(second - first, unit)
}

/** How much of a failed walk can be shown. */
function extentOf({ frames, header }: Replay): string {
  if (frames === 0) return 'There is nothing to show.'
  const { cycles, cycle_time } = header.scenario
  return header.duration < cycles * cycle_time - 0.01 ? 'Shown up to that point.' : 'Shown in full.'
}
