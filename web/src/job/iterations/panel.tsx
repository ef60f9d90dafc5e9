/** Table of all committed iterations, with filters and downloads. */

import type { Iteration, Job } from '../../api/types'
import { Card } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatMoment } from '../../format/time'
import { capitalized, inWords } from '../../format/words'
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
  const shown = iterations.filter(
    (i) =>
      (least === '' || (i.best !== null && i.best <= Number(least))) &&
      (!improved || isImprovement(iterations, i)),
  )
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <Card
      title="Iterations"
      tools={
        <span class="row">
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=csv`} download>
            Download CSV
          </a>
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=parquet`} download>
            Download Parquet
          </a>
        </span>
      }
    >
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
    </Card>
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
    minor = false,
  ): Column<Iteration> => ({
    key,
    label: capitalized(inWords(key)),
    unit,
    digits: 5,
    minor,
    value: (i) => i[key],
  })
  return [
    {
      key: 'index',
      label: 'Iteration',
      header: true,
      value: (i) => i.index,
      cell: (i) => <a href={jobPath(job.id, `iterations/${i.index}`)}>{i.index}</a>,
    },
    { key: 'designs', numeric: true, minor: true, value: (i) => i.designs },
    fitness('best'),
    fitness('median'),
    fitness('mean', true),
    fitness('worst', true),
    fitness('best_so_far'),
    { key: 'failed', numeric: true, value: (i) => i.failed },
    { key: 'time', unit: 's', digits: 3, minor: true, value: (i) => i.evaluate_seconds },
    {
      key: 'committed',
      minor: true,
      value: (i) => i.committed_at,
      cell: (i) => formatMoment(i.committed_at),
    },
  ]
}
