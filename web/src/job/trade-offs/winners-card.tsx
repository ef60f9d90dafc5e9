/** Best designs under the known preferences, and their positions relative to the front. */

import type { Front, FrontWinner, Job } from '../../api/types'
import { Table } from '../../components/table/table'
import { formatCount, percent } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { capitalized } from '../../format/words'
import { Where } from '../designs/selected-designs'
import { ownerWords } from './designs'
import { chooseColumn, objectiveColumns } from './front-table'

export function WinnersCard({
  job,
  front,
  onChoose,
}: {
  job: Job
  front: Front
  onChoose: (place: Place) => void
}) {
  return (
    <section class="card" aria-labelledby="front-winners">
      <h2 id="front-winners">Winners by preference</h2>
      <Table
        caption="Best designs by preference"
        rows={front.winners}
        rowKey={({ preference }) => preference}
        rowData={(winner) => ({
          'data-preference': winner.preference,
          'data-place': placeWord(winner),
        })}
        columns={[
          {
            key: 'preference',
            label: 'Best under',
            header: true,
            value: ({ preference }) => preference,
            cell: ({ preference }) => capitalized(ownerWords(preference)),
          },
          {
            key: 'design',
            label: 'Design',
            value: ({ iteration, particle }) => iteration * 1e5 + particle,
            cell: (winner) => <Where job={job} {...winner} />,
          },
          {
            key: 'dominated',
            label: 'On the front',
            value: ({ dominated_by }) => dominated_by,
            cell: (winner) => frontWords(winner),
          },
          ...objectiveColumns<FrontWinner>(front.objectives),
          chooseColumn(null, onChoose),
        ]}
      />
      <p class="muted small table-note">
        Biases apply in each scenario separately, so a design that is dominated over all scenarios
        can still win.
      </p>
    </section>
  )
}

function frontWords({ on_front, dominated_by, behind }: FrontWinner): string {
  if (on_front) return 'yes'
  return `no: dominated by ${formatCount(dominated_by)}, one of them ${percent(behind, 2)} better in every objective`
}
