/** Bounds that the winner touches, with a link to search beyond them. */

import type { Importance, Job, VariableImportance } from '../../api/types'
import { BrokenName } from '../../components/broken-name'
import { Empty } from '../../components/feedback'
import { Table } from '../../components/table/table'
import { exactQuantity, formatExact } from '../../format/number'
import { withQuery } from '../../router/routes'
import { widenQuery } from './outputs'

export function BoundsCard({ job, importance }: { job: Job; importance: Importance }) {
  const active = importance.variables.filter(({ at }) => at !== null)
  const widen = widenQuery(importance)
  return (
    <section
      class="card"
      aria-labelledby="bounds"
      data-active-bounds={active.map((v) => v.name).join(' ')}
    >
      <header class="row spread">
        <h2 id="bounds">Active bounds</h2>
        {widen !== '' && (
          <a class="button" href={withQuery('/jobs/new', { clone: job.id, widen })}>
            Widen and run again
          </a>
        )}
      </header>
      {active.length === 0 ? (
        <Empty title={importance.iteration === null ? 'No winner yet' : 'None'}>
          <p>
            {importance.iteration === null
              ? 'The active bounds appear here once a design has walked in every scenario.'
              : 'The winner is at least 1 % of the range away from every bound.'}
          </p>
        </Empty>
      ) : (
        <Table
          caption="Variables with the winner at a bound"
          rows={active}
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
              label: 'Winner',
              numeric: true,
              value: ({ winner }) => winner,
              cell: ({ winner, unit }) => exactQuantity(winner, unit),
            },
            { key: 'at', label: 'Bound', value: ({ at }) => at },
            {
              key: 'bounds',
              label: 'Search bounds',
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
  if (!widened) return 'none that can be simulated'
  return `${formatExact(widened.low)} to ${formatExact(widened.high)}`
}
