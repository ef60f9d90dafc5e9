/** Hypervolume of the front by iteration. */

import { useMemo } from 'preact/hooks'
import type { Front } from '../../api/types'
import { LineCard } from '../../charts/chart-card'
import { formatNumber } from '../../format/number'

export function HypervolumeCard({ front }: { front: Front }) {
  const { iterations, hypervolume, hypervolume_error: error } = front
  const drawn = useMemo(
    () => ({
      x: iterations.map(({ index }) => index),
      series: [
        {
          label: 'hypervolume',
          values: iterations.map((iteration) => iteration.hypervolume),
          colour: '--series-1' as const,
          width: 2,
        },
      ],
    }),
    [iterations],
  )
  const now = formatNumber(hypervolume, 4) + (error > 0 ? ` ± ${formatNumber(error, 1)}` : '')
  return (
    <LineCard
      title="Hypervolume"
      note={`Share of the box between ideal and reference point that the front dominates, on logarithmic axes. It never decreases. Current value: ${now}.`}
      caption="Hypervolume by iteration"
      order={{ column: 'x', descending: true }}
      label={`Hypervolume over ${iterations.length} iterations, now ${now}`}
      x={drawn.x}
      xLabel="iteration"
      counted
      yLabel="hypervolume"
      series={drawn.series}
      fromZero
      height={220}
    />
  )
}
