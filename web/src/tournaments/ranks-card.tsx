/** Methods by mean rank, with bootstrap intervals; which of them have a colour is chosen here. */

import type { TournamentStandings } from '../api/types'
import { ChartFrame } from '../charts/chart-frame'
import { StateBadge } from '../components/state-badge'
import { Table } from '../components/table/table'
import { formatCount, formatNumber } from '../format/number'
import { setQuery } from '../router/navigation'
import { jobPath } from '../router/routes'
import { MOST_COLOURED, OTHERS, type RankedMethod, toggled } from './methods'
import { RangeBars } from './range-bars'

export function RanksCard({
  found,
  methods,
}: {
  found: TournamentStandings
  methods: readonly RankedMethod[]
}) {
  const full = methods.filter(({ colour }) => colour !== null).length >= MOST_COLOURED
  return (
    <ChartFrame
      title="Mean ranks"
      note={
        'On each problem, a run is before another one if it reached the target in fewer' +
        ' evaluations, or alone, or if neither did and its best is less. 1 is the best; bars hold' +
        ' 95 % of resampled runs.'
      }
      table={() => <RanksTable found={found} methods={methods} />}
    >
      <RangeBars
        unit="mean rank over all problems"
        rows={methods.map(({ label, job, colour }) => {
          const rank = found.mean_ranks[label]
          return {
            key: label,
            label: (
              <label class="check">
                <input
                  type="checkbox"
                  checked={colour !== null}
                  disabled={colour === null && full}
                  onChange={(event) =>
                    setQuery({ methods: toggled(methods, job, event.currentTarget.checked) })
                  }
                />
                {label}
              </label>
            ),
            words:
              `${label}: mean rank ${formatNumber(rank.value, 3)},` +
              ` ${formatNumber(rank.low, 3)} to ${formatNumber(rank.high, 3)}`,
            colour: colour ?? OTHERS,
            ...rank,
          }
        })}
      />
      <p class="muted small">
        Up to {MOST_COLOURED} methods that are ticked have a colour in all charts; the others are
        grey.
      </p>
    </ChartFrame>
  )
}

function RanksTable({
  found,
  methods,
}: {
  found: TournamentStandings
  methods: readonly RankedMethod[]
}) {
  const entrants = new Map(found.tournament.entrants.map((entrant) => [entrant.label, entrant]))
  const number = (key: 'value' | 'low' | 'high', label: string) => ({
    key,
    label,
    numeric: true,
    value: (m: RankedMethod) => found.mean_ranks[m.label][key],
    cell: (m: RankedMethod) => formatNumber(found.mean_ranks[m.label][key], 3),
  })
  return (
    <Table
      caption="Mean ranks"
      rows={methods}
      rowKey={({ job }) => job}
      columns={[
        { key: 'label', label: 'Method', header: true, value: ({ label }) => label },
        number('value', 'Mean rank'),
        number('low', 'from'),
        number('high', 'to'),
        {
          key: 'runs',
          label: 'Runs',
          numeric: true,
          value: ({ label }) => entrants.get(label)?.runs ?? null,
          cell: ({ label }) => formatCount(entrants.get(label)?.runs),
        },
        {
          key: 'drawn',
          label: 'Settings drawn',
          minor: true,
          cell: ({ label }) => entrants.get(label)?.drawn.join(', ') || 'none',
        },
        {
          key: 'job',
          label: 'Job',
          cell: ({ label, job }) => {
            const state = entrants.get(label)?.state
            return (
              <span class="row">
                <a href={jobPath(job)}>{job}</a>
                {state && state !== 'succeeded' && <StateBadge state={state} />}
              </span>
            )
          },
        },
      ]}
    />
  )
}
