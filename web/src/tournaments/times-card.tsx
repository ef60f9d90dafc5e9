/** Expected running times on a problem, with the other numbers of its standings as a table. */

import type { Standing, TournamentStandings } from '../api/types'
import { ChartFrame } from '../charts/chart-frame'
import { type Column, Table } from '../components/table/table'
import { formatCount, formatExact, formatNumber } from '../format/number'
import { OTHERS, type RankedMethod } from './methods'
import { RangeBars } from './range-bars'

export function TimesCard({
  found,
  problem,
  methods,
}: {
  found: TournamentStandings
  problem: string
  methods: readonly RankedMethod[]
}) {
  const { target, methods: standings } = found.problems[problem]
  const colours = new Map(methods.map(({ label, colour }) => [label, colour]))
  const ranked = Object.entries(standings).sort(([, a], [, b]) => a.rank - b.rank)
  return (
    <ChartFrame
      title="Expected running time"
      note={
        `Evaluations until a fitness of ${formatExact(target)} is reached, if runs are repeated` +
        ' until one is successful (Hansen et al. 2021). Bars hold 95 % of resampled runs; one that' +
        ' ends at the edge has no upper bound. Methods by their rank on this problem.'
      }
      table={() => <StandingsTable looked={found.looked_at} ranked={ranked} problem={problem} />}
    >
      <RangeBars
        logarithmic
        unit="evaluations"
        absent="not reached"
        rows={ranked.map(([label, { expected_running_time: time, solved, runs }]) => ({
          key: label,
          label: (
            <>
              {label}{' '}
              <span class="muted small">
                {solved} of {runs} runs
              </span>
            </>
          ),
          words:
            time.value === null
              ? `${label}: no run reached it`
              : `${label}: ${formatCount(time.value)} evaluations,` +
                ` ${formatCount(time.low)} to ${formatCount(time.high)}`,
          colour: colours.get(label) ?? OTHERS,
          ...time,
        }))}
      />
    </ChartFrame>
  )
}

type Row = readonly [label: string, standing: Standing]

function StandingsTable({
  looked,
  ranked,
  problem,
}: {
  looked: readonly number[]
  ranked: readonly Row[]
  problem: string
}) {
  const time = (key: 'value' | 'low' | 'high', label: string): Column<Row> => ({
    key,
    label,
    numeric: true,
    value: ([, { expected_running_time }]) => expected_running_time[key],
    cell: ([, { expected_running_time }]) => formatCount(expected_running_time[key]),
  })
  return (
    <Table
      caption={`Standings on ${problem}`}
      rows={ranked}
      rowKey={([label]) => label}
      rowData={([label]) => ({ 'data-method': label })}
      columns={[
        { key: 'label', label: 'Method', header: true, value: ([label]) => label },
        {
          key: 'rank',
          label: 'Rank',
          numeric: true,
          value: ([, { rank }]) => rank,
          cell: ([, { rank }]) => formatExact(rank),
        },
        {
          key: 'solved',
          label: 'Solved',
          numeric: true,
          value: ([, { solved, runs }]) => solved / runs,
          cell: ([, { solved, runs }]) => `${solved} of ${runs}`,
        },
        time('value', 'Running time'),
        time('low', 'from'),
        time('high', 'to'),
        ...looked.map(
          (count): Column<Row> => ({
            key: `after-${count}`,
            label: `Median after ${formatCount(count)}`,
            numeric: true,
            value: ([, { median_best }]) => median_best[String(count)],
            cell: ([, { median_best }]) => formatNumber(median_best[String(count)]),
          }),
        ),
        {
          key: 'least',
          label: 'Least',
          numeric: true,
          value: ([, { least }]) => least,
          cell: ([, { least }]) => formatNumber(least),
        },
      ]}
    />
  )
}
