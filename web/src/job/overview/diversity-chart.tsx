/** Spread of the designs over the search space. */

import { useMemo } from 'preact/hooks'
import { LineCard } from '../../charts/chart-card'
import { percent } from '../../format/number'
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
    <LineCard
      title="Diversity of the designs"
      note={
        items.some(({ diversity }) => diversity !== null)
          ? 'Spread of the designs as a share of each variable’s range; near zero, the search has converged.'
          : 'The method evaluates one design at a time, which has no spread.'
      }
      caption="Diversity by iteration"
      order={{ column: 'x', descending: true }}
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
  )
}
