/** What another engine makes of a certificate's nominal world, beside what ours makes of it. */

import type { Compared, ComparedEngine, Job } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { change, formatNumber, withUnit } from '../../format/number'
import { inWords } from '../../format/words'

interface Row {
  readonly scenario: string
  readonly quantity: string
  readonly unit: string
  /** How both walks ended, if one of them failed. */
  readonly ended: string
  readonly found: Compared
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
      <h2 id={id}>The nominal world in {name}</h2>
      <p>
        {engine.description}. It walks in <strong>{walked}</strong> of {scenarios.length} scenarios,
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
  return Object.entries(engine.scenarios).flatMap(([scenario, found]) => {
    const { ours, theirs } = found
    const ended = ours === 'ok' && theirs === 'ok' ? '' : `${ours}, ${theirs}`
    const one = (quantity: string, unit: string, compared: Compared): Row => ({
      scenario,
      quantity,
      unit,
      ended,
      found: compared,
    })
    return [
      ...objectives.flatMap(({ name, unit }) => {
        const compared = found.objectives[name]
        return compared ? [one(name, unit, compared)] : []
      }),
      one('utility', '1', found.utility),
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
      cell: ({ found }) => formatNumber(found.ours),
    },
    {
      key: 'theirs',
      label: name,
      numeric: true,
      cell: ({ found }) => formatNumber(found.theirs),
    },
    {
      key: 'difference',
      label: 'Difference',
      numeric: true,
      value: ({ found }) => (found.difference === null ? null : Math.abs(found.difference)),
      cell: ({ found }) => asPercent(found),
    },
  ]
}

function asPercent({ difference }: Compared): string {
  return change(difference === null ? null : 100 * difference, '%', 2)
}
