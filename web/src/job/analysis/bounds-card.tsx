/** Whether the winner lies at a bound of the search, and the way to search beyond it. */

import type { Importance, Job, VariableImportance } from '../../api/types'
import { BrokenName } from '../../components/broken-name'
import { Empty } from '../../components/feedback'
import { Table } from '../../components/table/table'
import { exactQuantity, formatExact } from '../../format/number'
import { withQuery } from '../../router/routes'
import { widenQuery } from './outputs'

export function BoundsCard({ job, found }: { job: Job; found: Importance }) {
  const held = found.variables.filter(({ at }) => at !== null)
  const widen = widenQuery(found)
  return (
    <section class="card" aria-labelledby="bounds" data-held={held.map((v) => v.name).join(' ')}>
      <header class="row spread">
        <h2 id="bounds">Bounds that hold the winner</h2>
        {widen !== '' && (
          <a class="button" href={withQuery('/jobs/new', { clone: job.id, widen })}>
            Widen and run again
          </a>
        )}
      </header>
      {held.length === 0 ? (
        <Empty title={found.iteration === null ? 'No winner yet' : 'None'}>
          <p>
            {found.iteration === null
              ? 'It is told here as soon as a design has walked in every case.'
              : 'The winner lies inside the bounds of every variable, by a hundredth of the range at least.'}
          </p>
        </Empty>
      ) : (
        <Table
          caption="Variables in which the winner lies at a bound"
          rows={held}
          rowKey={({ name }) => name}
          columns={[
            {
              key: 'name',
              label: 'Variable',
              header: true,
              value: ({ name }) => name,
              cell: ({ name }) => <BrokenName name={name} />,
            },
            {
              key: 'winner',
              label: 'The winner',
              numeric: true,
              value: ({ winner }) => winner,
              cell: ({ winner, unit }) => exactQuantity(winner, unit),
            },
            { key: 'at', label: 'Bound', value: ({ at }) => at },
            {
              key: 'bounds',
              label: 'Searched',
              cell: ({ low, high }) => `${formatExact(low)} to ${formatExact(high)}`,
            },
            { key: 'widened', label: 'Wider bounds', cell: widerWords },
          ]}
        />
      )}
    </section>
  )
}

function widerWords({ widened }: VariableImportance): string {
  if (!widened) return 'none known that can be simulated'
  return `${formatExact(widened.low)} to ${formatExact(widened.high)}`
}
