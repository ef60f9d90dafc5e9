/** Start designs of a job. */

import type { Job } from '../../api/types'
import { type Column, Table } from '../../components/table/table'
import { formatCount } from '../../format/number'
import { type Design, formatExactValue } from '../../format/value'
import { startDesigns } from '../start'

export function StartCard({ job }: { job: Job }) {
  const designs = startDesigns(job)
  if (designs.length === 0) return null
  const names = [...new Set(designs.flatMap((design) => Object.keys(design)))]
  const rows = designs.map((design, number) => ({ design, number }))
  return (
    <section class="card" aria-labelledby="start">
      <h2 id="start">Start designs</h2>
      <p class="muted small">
        {formatCount(designs.length)} given designs that were evaluated first; the search starts
        from them if its method supports it.
      </p>
      <Table
        caption="Start designs"
        rows={rows}
        rowKey={({ number }) => String(number)}
        pageSize={20}
        columns={[
          {
            key: 'number',
            label: 'Design',
            header: true,
            numeric: true,
            value: ({ number }) => number,
          },
          ...names.map(
            (name): Column<{ design: Design; number: number }> => ({
              key: name,
              label: name,
              numeric: true,
              value: ({ design }) => design[name] ?? null,
              cell: ({ design }) => formatExactValue(design[name]),
            }),
          ),
        ]}
      />
    </section>
  )
}
