/** Membership functions of an input or output. */

import { useMemo } from 'preact/hooks'
import { LineCard } from '../charts/chart-card'
import type { Series } from '../charts/lines/line-chart'
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
      <LineCard
        title={`${side}: ${name}`}
        note="Degree of membership; the line marks the selected point."
        caption={`Degrees of membership of ${name}`}
        format={(degree) => formatNumber(degree, 3)}
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
    </div>
  )
}
