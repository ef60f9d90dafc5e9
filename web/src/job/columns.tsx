/** Table columns and links that several tabs have. */

import type { Job, Objective } from '../api/types'
import type { Column } from '../components/table/table'
import { BrokenName } from '../components/text'
import { type Place, placeWord } from '../format/place'
import { inWords } from '../format/words'
import { jobPath, withQuery } from '../router/routes'
import { amountOf, quantityOf, type WithObjectives } from './quantity'

/** A row's name, which may wrap after underscores. */
export const VARIABLE: Column<{ readonly name: string }> = {
  key: 'name',
  label: 'Variable',
  header: true,
  value: ({ name }) => name,
  cell: ({ name }) => <BrokenName name={name} />,
}

/** Link to a design's simulation, or to its iteration if it has none. */
export function DesignLink({ job, iteration, particle }: Place & { job: Job }) {
  const target =
    job.kind === 'tuning'
      ? withQuery('/walk', { job: job.id, iteration, particle, scenario: job.scenarios[0] })
      : jobPath(job.id, `iterations/${iteration}`)
  return (
    <a href={target} class="nowrap">
      design {placeWord({ iteration, particle })}
    </a>
  )
}

export function designColumn(job: Job, header = false): Column<Place> {
  return {
    key: 'design',
    header,
    value: ({ iteration, particle }) => iteration * 1e5 + particle,
    cell: ({ iteration, particle }) => (
      <DesignLink job={job} iteration={iteration} particle={particle} />
    ),
  }
}

export function objectiveColumns(objectives: readonly Objective[]): Column<WithObjectives>[] {
  return objectives.map(quantityOf).map((shown) => ({
    key: shown.name,
    label: inWords(shown.name),
    unit: shown.unit,
    digits: 4,
    value: (row) => amountOf(row, shown),
  }))
}
