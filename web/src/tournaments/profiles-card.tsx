/** Data profiles: which share of its runs a method has solved within a budget. */

import type { TournamentProfile } from '../api/types'
import { ChartFrame, LegendEntry } from '../charts/chart-frame'
import type { Series } from '../charts/lines/line-chart'
import { LinkedChart } from '../charts/lines/linked-chart'
import { Table } from '../components/table/table'
import { formatExact, percent } from '../format/number'
import { OTHERS, type RankedMethod } from './methods'

export function ProfilesCard({
  profiles,
  methods,
}: {
  profiles: readonly TournamentProfile[]
  methods: readonly RankedMethod[]
}) {
  return (
    <div class="grid">
      {profiles.map((profile) => (
        <ChartFrame
          key={profile.precision}
          title={`Data profile, τ = ${formatExact(profile.precision)}`}
          note={
            'Share of runs on all problems that have come from the usual first value all but a' +
            ' share τ of the way to the least value that any run found (Moré and Wild 2009).'
          }
          legend={<MethodLegend methods={methods} />}
          table={() => <ProfileTable profile={profile} methods={methods} />}
        >
          <LinkedChart
            zoomName={`zoom-${profile.precision}`}
            label={`Share of solved runs of ${methods.length} methods over the budget`}
            x={profile.budgets}
            xLabel="evaluations / (variables + 1)"
            xLogarithmic
            yLabel="solved runs"
            yUnit="%"
            fromZero
            series={methods.map(
              ({ label, colour }): Series => ({
                label,
                values: profile.shares[label].map((share) => 100 * share),
                colour: colour ?? OTHERS,
                width: colour === null ? 0.8 : 2,
                stepped: true,
                silent: colour === null,
              }),
            )}
          />
        </ChartFrame>
      ))}
    </div>
  )
}

/** The methods in colour. */
export function MethodLegend({ methods }: { methods: readonly RankedMethod[] }) {
  const coloured = methods.filter(({ colour }) => colour !== null)
  return (
    <>
      {coloured.map(({ label, colour }) => (
        <LegendEntry key={label} colour={colour ?? OTHERS} label={label} />
      ))}
      {coloured.length < methods.length && <LegendEntry colour={OTHERS} label="others" />}
    </>
  )
}

function ProfileTable({
  profile,
  methods,
}: {
  profile: TournamentProfile
  methods: readonly RankedMethod[]
}) {
  return (
    <Table
      caption={`Share of solved runs, τ = ${formatExact(profile.precision)}`}
      rows={profile.budgets.map((budget, row) => ({ budget, row }))}
      rowKey={({ row }) => String(row)}
      tall
      pageSize={60}
      columns={[
        {
          key: 'budget',
          label: 'Evaluations / (variables + 1)',
          header: true,
          numeric: true,
          value: ({ budget }) => budget,
          cell: ({ budget }) => formatExact(budget, 3),
        },
        ...methods.map(({ label }) => ({
          key: label,
          label,
          numeric: true,
          value: ({ row }: { row: number }) => profile.shares[label][row],
          cell: ({ row }: { row: number }) => percent(profile.shares[label][row], 3),
        })),
      ]}
    />
  )
}
