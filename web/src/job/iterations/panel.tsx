/** Table of all committed iterations, with filters and downloads. */

import type { Iteration, Job } from '../../api/types'
import { Empty } from '../../components/feedback'
import { Check } from '../../components/fields/check'
import { type Column, Table } from '../../components/table/table'
import { formatNumber } from '../../format/number'
import { formatMoment } from '../../format/time'
import { type Codec, flag, ORDER, PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { jobPath } from '../../router/routes'
import { fitnessUnit } from '../fitness'
import type { LiveJob } from '../live/use-job'

const NEWEST = { column: 'index', descending: true }

/** A number as typed, or empty. */
const AT_MOST: Codec<string> = {
  read: (text) => (text !== '' && Number.isFinite(Number(text)) ? text : undefined),
  write: (text) => text || null,
}

export function IterationsPanel({ live, job }: { live: LiveJob; job: Job }) {
  const { iterations } = live.followed
  const [least, setLeast] = useQueryValue('most', AT_MOST, '')
  const [improved, setImproved] = useQueryValue('improved', flag(false), false)
  const [order, setOrder] = useQueryValue('sort', ORDER, NEWEST)
  const below = least === '' ? Number.POSITIVE_INFINITY : Number(least)
  const shown = iterations.filter(
    (i) =>
      (below === Number.POSITIVE_INFINITY || (i.best !== null && i.best <= below)) &&
      (!improved || isImprovement(iterations, i)),
  )
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <section class="card" aria-labelledby="iterations">
      <header class="row spread">
        <h2 id="iterations">Iterations</h2>
        <span class="row">
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=csv`} download>
            Download CSV
          </a>
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=parquet`} download>
            Download Parquet
          </a>
        </span>
      </header>
      {iterations.length === 0 ? (
        <Empty title="No iteration yet">
          <p>Iterations appear here as they are committed.</p>
        </Empty>
      ) : (
        <div class="stack">
          <search class="row">
            <label class="row small">
              Best at most
              <input
                type="number"
                step="any"
                class="short"
                value={least}
                onInput={(event) => setLeast(event.currentTarget.value)}
              />
            </label>
            <Check label="only improvements" checked={improved} onChange={setImproved} />
            <span class="muted small" aria-live="polite">
              {shown.length} of {iterations.length}
            </span>
          </search>
          <Table
            caption="Iterations"
            rows={shown}
            rowKey={(i) => String(i.index)}
            paging={paging}
            order={order}
            onOrder={setOrder}
            columns={columns(job)}
            rowData={(i) => ({ 'data-index': i.index })}
          />
        </div>
      )}
    </section>
  )
}

function isImprovement(iterations: readonly Iteration[], { index, best_so_far }: Iteration) {
  const before = iterations[index - 1]?.best_so_far ?? null
  return best_so_far !== null && (before === null || best_so_far < before)
}

function columns(job: Job): readonly Column<Iteration>[] {
  const unit = fitnessUnit(job)
  const fitness = (
    key: 'best' | 'median' | 'mean' | 'worst' | 'best_so_far',
    label: string,
    minor = false,
  ): Column<Iteration> => ({
    key,
    label,
    unit,
    numeric: true,
    minor,
    value: (i) => i[key],
    cell: (i) => formatNumber(i[key], 5),
  })
  return [
    {
      key: 'index',
      label: 'Iteration',
      header: true,
      value: (i) => i.index,
      cell: (i) => <a href={jobPath(job.id, `iterations/${i.index}`)}>{i.index}</a>,
    },
    { key: 'designs', label: 'Designs', numeric: true, minor: true, value: (i) => i.designs },
    fitness('best', 'Best'),
    fitness('median', 'Median'),
    fitness('mean', 'Mean', true),
    fitness('worst', 'Worst', true),
    fitness('best_so_far', 'Best so far'),
    { key: 'failed', label: 'Failed', numeric: true, value: (i) => i.failed },
    {
      key: 'seconds',
      label: 'Time',
      unit: 's',
      numeric: true,
      minor: true,
      value: (i) => i.evaluate_seconds,
      cell: (i) => formatNumber(i.evaluate_seconds, 3),
    },
    {
      key: 'committed',
      label: 'Committed',
      minor: true,
      value: (i) => i.committed_at,
      cell: (i) => formatMoment(i.committed_at),
    },
  ]
}
