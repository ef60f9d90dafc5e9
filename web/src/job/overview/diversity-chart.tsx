/** Spread of the designs over the search space. */

import { useMemo } from 'preact/hooks'
import { ChartFrame } from '../../charts/chart-frame'
import { LinkedChart } from '../../charts/lines/linked-chart'
import { percent } from '../../format/number'
import { ByIteration } from '../by-iteration'
import type { Distribution } from './use-distribution'

export function DiversityChart({ distribution }: { distribution: Distribution }) {
  const { items } = distribution
  const drawn = useMemo(
    () => ({
      x: items.map((item) => item.index),
      series: [
        {
          label: 'diversity',
          values: items.map((item) => (item.diversity === null ? null : item.diversity * 100)),
          colour: '--series-3' as const,
        },
      ],
    }),
    [items],
  )
  return (
    <ChartFrame
      title="Diversity of the designs"
      note={
        items.some(({ diversity }) => diversity !== null)
          ? 'Spread of the designs as a share of each variable’s range; near zero, the search has converged.'
          : 'The method evaluates one design at a time, which has no spread.'
      }
      table={() => (
        <ByIteration
          caption="Diversity by iteration"
          rows={items}
          columns={[
            {
              key: 'diversity',
              label: 'Diversity',
              numeric: true,
              value: (item) => item.diversity,
              cell: (item) => percent(item.diversity),
            },
          ]}
        />
      )}
    >
      <LinkedChart
        zoomName="zoom-diversity"
        label={`Diversity of the designs, now ${percent(items.at(-1)?.diversity)} of the range`}
        x={drawn.x}
        xLabel="iteration"
        counted
        yLabel="diversity"
        yUnit="%"
        series={drawn.series}
        fromZero
      />
    </ChartFrame>
  )
}
