/** How near a calibration comes to its targets. */

import { get } from '../api/client'
import { useResource } from '../api/resource'
import type { Job, TargetResult } from '../api/types'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { Table } from '../components/table'
import { change, formatNumber } from '../format/number'
import { inWords } from '../format/words'

export function TargetsPanel({ job }: { job: Job }) {
  const key = job.best ? `${job.id} ${job.best.iteration} ${job.best.particle}` : null
  const found = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/targets', { path: { job_id: job.id }, signal }),
  )
  return (
    <section class="card" aria-labelledby="targets">
      <h2 id="targets">Targets of the winner</h2>
      {!job.best && (
        <Empty title="No winner yet">
          <p>No design has walked in every walk so far. Its results appear here.</p>
        </Empty>
      )}
      {found.loading && <Loading what="the targets" />}
      {found.error && (
        <ErrorNotice what="The targets cannot be shown." error={found.error} retry={found.reload} />
      )}
      {found.data && <TargetsTable targets={found.data.targets} />}
    </section>
  )
}

function TargetsTable({ targets }: { targets: readonly TargetResult[] }) {
  return (
    <Table
      caption="Targets of the winner"
      rows={targets}
      rowKey={(t) => [t.walk, t.relative_to, t.quantity, t.value].join(' ')}
      columns={[
        { key: 'walk', label: 'Walk', header: true, value: walkOf },
        { key: 'quantity', label: 'Quantity', value: (t) => inWords(t.quantity) },
        { key: 'unit', label: 'Unit', minor: true, value: (t) => (t.unit === '1' ? '–' : t.unit) },
        {
          key: 'value',
          label: 'Target',
          numeric: true,
          value: (t) => t.value,
          cell: (t) => formatNumber(t.value),
        },
        {
          key: 'simulated',
          label: 'Simulated',
          numeric: true,
          value: (t) => t.simulated,
          cell: (t) => formatNumber(t.simulated),
        },
        {
          key: 'difference',
          label: 'Off by',
          unit: 'tolerances',
          numeric: true,
          value: (t) => t.difference,
          cell: (t) => change(t.difference, '1', 2),
        },
        {
          key: 'use',
          label: 'Use',
          minor: true,
          value: (t) => (t.use === 'fit' ? 'fitted' : 'predicted'),
        },
      ]}
    />
  )
}

function walkOf({ walk, relative_to: other }: TargetResult): string {
  return other === null ? walk : `${walk} / ${other}`
}
