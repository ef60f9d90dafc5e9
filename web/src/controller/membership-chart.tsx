/** Membership functions of an input or output. */

import { useMemo } from 'preact/hooks'
import { ChartFrame, LegendEntry } from '../charts/chart-frame'
import type { Series } from '../charts/lines/line-chart'
import { LinkedChart } from '../charts/lines/linked-chart'
import { type Column, Table } from '../components/table/table'
import { formatNumber } from '../format/number'
import type { Universe } from './surface'

const COLOURS = ['--series-1', '--series-2', '--series-3', '--series-4', '--series-5'] as const

export function MembershipChart({
  universe,
  side,
  marker,
}: {
  universe: Universe
  side: 'Input' | 'Output'
  /** Value at the selected point. */
  marker: number
}) {
  const { name, unit, values, memberships } = universe
  const series = useMemo(
    () =>
      memberships.map(
        (membership, k): Series => ({
          label: membership.name,
          values: membership.degrees,
          colour: COLOURS[k % COLOURS.length],
          width: 2,
        }),
      ),
    [memberships],
  )
  return (
    <div class="plot" data-membership={name}>
      <ChartFrame
        title={`${side}: ${name}`}
        note="Degree of membership; the line marks the selected point."
        table={() => <MembershipTable universe={universe} />}
        legend={series.map(({ label, colour }) => (
          <LegendEntry key={label} label={label} colour={colour} />
        ))}
      >
        <LinkedChart
          zoomName={`zoom-${name}`}
          label={`Fuzzy sets of ${name}: ${memberships.map((m) => m.name).join(', ')}`}
          x={values}
          xLabel={name}
          xUnit={unit}
          yLabel="membership"
          series={series}
          height={170}
          marker={marker}
        />
      </ChartFrame>
    </div>
  )
}

function MembershipTable({ universe }: { universe: Universe }) {
  const { name, unit, values, memberships } = universe
  const columns: Column<number>[] = [
    {
      key: 'value',
      label: name,
      unit,
      numeric: true,
      header: true,
      value: (row) => values[row],
      cell: (row) => formatNumber(values[row]),
    },
    ...memberships.map(
      (membership): Column<number> => ({
        key: membership.name,
        label: membership.name,
        numeric: true,
        value: (row) => membership.degrees[row],
        cell: (row) => formatNumber(membership.degrees[row], 3),
      }),
    ),
  ]
  return (
    <Table
      caption={`Degrees of membership of ${name}`}
      columns={columns}
      rows={values.map((_, row) => row)}
      rowKey={String}
      pageSize={129}
      tall
    />
  )
}
