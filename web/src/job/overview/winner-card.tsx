/** Values of the winner and their positions between the bounds. */

import type { Job } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { Table } from '../../components/table/table'
import { BrokenName } from '../../components/text'
import { formatExact, NONE, percent } from '../../format/number'
import { placeWord } from '../../format/place'
import { exactValueQuantity } from '../../format/value'
import { withQuery } from '../../router/routes'
import { VARIABLE } from '../columns'
import { searchedVariables } from '../facts'
import { type WinnerVariable, winnerVariables } from './model'

export function WinnerCard({ job }: { job: Job }) {
  const best = job.best!
  const rows = winnerVariables(best.design, searchedVariables(job.spec))
  const atBound = rows.filter(({ at }) => at !== null)
  const place = { job: job.id, iteration: best.iteration, particle: best.particle }
  return (
    <ChartCard
      title="Winner"
      note={`Design ${placeWord(best)}. Bars show the search ranges.${
        atBound.length > 0 ? ` At a bound: ${atBound.map(({ name }) => name).join(', ')}.` : ''
      }`}
      tools={
        job.kind === 'tuning' && (
          <>
            <a class="button compact" href={withQuery('/walk', place)}>
              Show replay
            </a>
            <a class="button compact" href={withQuery('/controller', place)}>
              Show controller
            </a>
          </>
        )
      }
      table={() => (
        <Table<WinnerVariable>
          caption="Winner and search bounds"
          rows={rows}
          pageSize={60}
          columns={[
            VARIABLE,
            {
              key: 'value',
              numeric: true,
              value: ({ value }) => value,
              cell: ({ value, unit }) => exactValueQuantity(value, unit),
            },
            {
              key: 'from',
              numeric: true,
              value: ({ low }) => low,
              cell: ({ low }) => formatExact(low),
            },
            {
              key: 'to',
              numeric: true,
              value: ({ high }) => high,
              cell: ({ high }) => formatExact(high),
            },
            { key: 'position in range', percent: 3, value: ({ share }) => share },
            { key: 'bound', value: ({ at, fixed }) => (fixed ? 'fixed' : (at ?? NONE)) },
          ]}
        />
      )}
    >
      <dl class="design" data-active-bounds={atBound.map(({ name }) => name).join(' ')}>
        {rows.map((row) => (
          <div key={row.name}>
            <dt>
              <BrokenName name={row.name} />
            </dt>
            <dd>{exactValueQuantity(row.value, row.unit)}</dd>
            <dd class="in-bounds">
              {row.share === null ? (
                <span class="muted small">{row.fixed ? 'fixed' : 'categorical'}</span>
              ) : (
                <RangeBar row={row} />
              )}
            </dd>
          </div>
        ))}
      </dl>
    </ChartCard>
  )
}

function RangeBar({ row }: { row: WinnerVariable }) {
  return (
    <>
      <div class="range-bar" role="img" aria-label={inWords(row)} data-at={row.at ?? undefined}>
        <i style={{ width: `${100 * row.share!}%` }} />
        <b style={{ left: `${100 * row.share!}%` }} />
      </div>
      <span class="range-ends muted small" aria-hidden="true">
        <span>{formatExact(row.low, 4)}</span>
        {row.at !== null && <strong>at bound</strong>}
        <span>{formatExact(row.high, 4)}</span>
      </span>
    </>
  )
}

function inWords({ low, high, share, at }: WinnerVariable): string {
  const range = `of the range from ${formatExact(low)} to ${formatExact(high)}`
  return `at ${percent(share, 3)} ${range}${at === null ? '' : `, at the ${at === 'low' ? 'lower' : 'upper'} bound`}`
}
