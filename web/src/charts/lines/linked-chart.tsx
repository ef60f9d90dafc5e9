/** A line chart whose zoom is stored in the address. */

import { RANGE, useQueryValue } from '../../router/query-value'
import { LineChart, type LineChartProps } from './line-chart'

export function LinkedChart({
  zoomName = 'zoom',
  ...props
}: Omit<LineChartProps, 'zoom' | 'onZoom'> & {
  /** Query parameter; charts with the same one zoom together. */
  zoomName?: string
}) {
  const [zoom, setZoom] = useQueryValue(zoomName, RANGE, null)
  return <LineChart {...props} zoom={zoom} onZoom={setZoom} />
}
