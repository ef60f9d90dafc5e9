/** Results of a robot's check: mass, legs, stance, warnings and guesses. */

import type { CheckedLeg, RobotCheck } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { exactQuantity, formatExact, formatNumber, quantity } from '../../format/number'

const COLUMNS: readonly Column<CheckedLeg>[] = [
  { key: 'name', label: 'Leg', value: ({ name }) => name, header: true },
  { key: 'joints', label: 'Joints', cell: ({ joints }) => joints.join(', '), minor: true },
  { key: 'foot', label: 'Foot', value: ({ foot }) => foot },
  { key: 'length', label: 'Length', unit: 'm', numeric: true, ...metres(({ length }) => length) },
  { key: 'reach', label: 'Reach', unit: 'm', numeric: true, ...metres(({ reach }) => reach) },
]

export function Findings({ check, guesses }: { check: RobotCheck; guesses: readonly string[] }) {
  const { standing } = check
  const fixedJoints = Object.entries(check.held)
  return (
    <section class="stack" aria-label="Check results" data-warnings={check.warnings.length}>
      <p>
        <strong>{check.name}</strong>: {check.legs.length} legs, {check.joints} joints,{' '}
        {quantity(check.mass, 'kg')}. After standing for {exactQuantity(standing.seconds, 's')}, its
        soles carry {quantity(standing.normal_forces, 'N')} of {quantity(standing.weight, 'N')}; its
        body is at {quantity(standing.height, 'm', 3)}.
        {fixedJoints.length > 0 &&
          ` Fixed joints: ${fixedJoints.map(([name, at]) => `${name} at ${formatExact(at)} rad`).join(', ')}.`}
      </p>
      {check.warnings.length > 0 && (
        <div class="notice" data-tone="warn">
          <strong>Warnings (the job can still be submitted)</strong>
          <ul>
            {check.warnings.map((warning) => (
              <li key={warning}>{warning}</li>
            ))}
          </ul>
        </div>
      )}
      <Table caption="Legs" columns={COLUMNS} rows={check.legs} rowKey={({ name }) => name} />
      {guesses.length > 0 && (
        <div>
          <p>Guessed values, to be verified in robot.toml:</p>
          <ul>
            {guesses.map((guess) => (
              <li key={guess}>{guess}</li>
            ))}
          </ul>
        </div>
      )}
    </section>
  )
}

function metres(value: (leg: CheckedLeg) => number) {
  return { value, cell: (leg: CheckedLeg) => formatNumber(value(leg), 3) }
}
