/** Hypervolume of the front by iteration. */

import { useMemo } from 'preact/hooks'
import type { Front } from '../../api/types'
import { ChartFrame } from '../../charts/chart-frame'
import { LinkedChart } from '../../charts/lines/linked-chart'
import { formatNumber } from '../../format/number'
import { ByIteration } from '../by-iteration'

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
    <ChartFrame
      title="Hypervolume"
      note={`Share of the box between ideal and reference point that the front dominates, on logarithmic axes. It never decreases. Current value: ${now}.`}
      table={() => (
        <ByIteration
          caption="Hypervolume by iteration"
          rows={iterations}
          columns={[
            {
              key: 'hypervolume',
              label: 'Hypervolume',
              numeric: true,
              value: (row) => row.hypervolume,
              cell: (row) => formatNumber(row.hypervolume, 4),
            },
          ]}
        />
      )}
    >
      <LinkedChart
        label={`Hypervolume over ${iterations.length} iterations, now ${now}`}
        x={drawn.x}
        xLabel="iteration"
        counted
        yLabel="hypervolume"
        series={drawn.series}
        fromZero
        height={220}
      />
    </ChartFrame>
  )
}
