/** A certificate's nominal world in another physics engine, compared with gaitswarm. */

import type { Compared, ComparedEngine, Job } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { change, formatNumber, withUnit } from '../../format/number'
import { inWords } from '../../format/words'

interface Row {
  readonly scenario: string
  readonly quantity: string
  readonly unit: string
  /** Both final statuses, if either failed. */
  readonly ended: string
  readonly comparison: Compared
}

export function OtherEngine({
  name,
  engine,
  objectives,
}: {
  name: string
  engine: ComparedEngine
  objectives: Job['objectives']
}) {
  const scenarios = Object.entries(engine.scenarios)
  const walked = scenarios.filter(([, { theirs }]) => theirs === 'ok').length
  const id = `engine-${name}`
  return (
    <section class="card" aria-labelledby={id} data-engine={name}>
      <h2 id={id}>Nominal world in {name}</h2>
      <p>
        {engine.description}. <strong>{walked}</strong> of {scenarios.length} scenarios succeed,
        with a fitness of {formatNumber(engine.fitness.theirs)} instead of{' '}
        {formatNumber(engine.fitness.ours)}: {asPercent(engine.fitness)}.
      </p>
      <Table
        caption={`Scenarios and objectives in ${name}`}
        rows={rowsOf(engine, objectives)}
        rowKey={({ scenario, quantity }) => `${scenario} ${quantity}`}
        columns={columnsOf(name)}
        pageSize={2 * (objectives.length + 1)}
      />
    </section>
  )
}

function rowsOf(engine: ComparedEngine, objectives: Job['objectives']): readonly Row[] {
  return Object.entries(engine.scenarios).flatMap(([scenario, comparison]) => {
    const { ours, theirs } = comparison
    const ended = ours === 'ok' && theirs === 'ok' ? '' : `${ours}, ${theirs}`
    const one = (quantity: string, unit: string, compared: Compared): Row => ({
      scenario,
      quantity,
      unit,
      ended,
      comparison: compared,
    })
    return [
      ...objectives.flatMap(({ name, unit }) => {
        const compared = comparison.objectives[name]
        return compared ? [one(name, unit, compared)] : []
      }),
      one('utility', '1', comparison.utility),
    ]
  })
}

function columnsOf(name: string): readonly Column<Row>[] {
  return [
    {
      key: 'scenario',
      label: 'Scenario',
      header: true,
      value: ({ scenario }) => scenario,
      cell: ({ scenario, ended }) => (ended ? `${scenario} (${ended})` : scenario),
    },
    {
      key: 'objective',
      label: 'Objective',
      value: ({ quantity }) => quantity,
      cell: ({ quantity, unit }) => withUnit(inWords(quantity), unit),
    },
    {
      key: 'ours',
      label: 'gaitswarm',
      numeric: true,
      cell: ({ comparison }) => formatNumber(comparison.ours),
    },
    {
      key: 'theirs',
      label: name,
      numeric: true,
      cell: ({ comparison }) => formatNumber(comparison.theirs),
    },
    {
      key: 'difference',
      label: 'Difference',
      numeric: true,
      value: ({ comparison }) =>
        comparison.difference === null ? null : Math.abs(comparison.difference),
      cell: ({ comparison }) => asPercent(comparison),
    },
  ]
}

function asPercent({ difference }: Compared): string {
  return change(difference === null ? null : 100 * difference, '%', 2)
}
