/** Table of the designs of a front, with their properties and objectives. */

import type { Front, FrontDesign, Job, Objective } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { Where } from '../designs/selected-designs'
import type { PublishedDesign } from './designs'

/** Common to all designs listed with objectives. */
interface ByObjective {
  readonly objectives: Readonly<Record<string, number>>
}

export function FrontTable({
  job,
  front,
  chosen,
  onChoose,
}: {
  job: Job
  front: Front
  chosen: Place | null
  onChoose: (place: Place) => void
}) {
  const columns: readonly Column<FrontDesign>[] = [
    {
      key: 'design',
      label: 'Design',
      header: true,
      value: ({ iteration, particle }) => iteration * 1e5 + particle,
      cell: (design) => <Where job={job} {...design} />,
    },
    {
      key: 'marks',
      label: 'Property',
      value: ({ marks }) => (marks.length === 0 ? null : marks.join(', ')),
      cell: ({ marks }) => (marks.length === 0 ? NONE : marks.map(inWords).join(', ')),
    },
    ...objectiveColumns<FrontDesign>(front.objectives),
    {
      key: 'fitness',
      label: 'Fitness',
      numeric: true,
      value: ({ fitness }) => fitness,
      cell: ({ fitness }) => formatNumber(fitness, 5),
    },
    chooseColumn(chosen, onChoose),
  ]
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <Table
      caption="Designs of the front"
      rows={front.designs}
      rowKey={placeWord}
      paging={paging}
      order={{ column: 'marks', descending: false }}
      pageSize={20}
      columns={columns}
    />
  )
}

/** Table of published designs with the same objectives. */
export function PublishedTable({
  front,
  designs,
}: {
  front: Front
  designs: readonly PublishedDesign[]
}) {
  return (
    <Table
      caption="Published designs"
      rows={designs}
      rowKey={({ label }) => label}
      columns={[
        { key: 'design', label: 'Design', header: true, value: ({ label }) => label },
        ...objectiveColumns<PublishedDesign>(front.objectives),
      ]}
    />
  )
}

/** One column per objective. */
export function objectiveColumns<R extends ByObjective>(
  objectives: readonly Objective[],
): readonly Column<R>[] {
  return objectives.map(({ name, unit }) => ({
    key: name,
    label: inWords(name),
    unit,
    numeric: true,
    value: (row) => row.objectives[name] ?? null,
    cell: (row) => formatNumber(row.objectives[name]),
  }))
}

/** Column of buttons that fit a preference to the row's design. */
export function chooseColumn<R extends Place>(
  chosen: Place | null,
  onChoose: (place: Place) => void,
): Column<R> {
  return {
    key: 'choose',
    label: 'Preference',
    cell: (design) => (
      <button
        type="button"
        class="compact"
        aria-pressed={chosen !== null && placeWord(chosen) === placeWord(design)}
        aria-label={`Find the preference that selects design ${placeWord(design)}`}
        onClick={() => onChoose(design)}
      >
        Find
      </button>
    ),
  }
}
