/** A chart of lines whose zoom is in the address. */

import { RANGE, useQueryValue } from '../../router/query-value'
import { LineChart, type LineChartProps } from './line-chart'

export function LinkedChart({
  zoomName = 'zoom',
  ...props
}: Omit<LineChartProps, 'zoom' | 'onZoom'> & {
  /** Of the query; charts that are zoomed together share one. */
  zoomName?: string
}) {
  const [zoom, setZoom] = useQueryValue(zoomName, RANGE, null)
  return <LineChart {...props} zoom={zoom} onZoom={setZoom} />
}
