/** Interactive three-dimensional view of a control surface. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { messageOf } from '../api/problem'
import { describeCanvas } from '../charts/canvas'
import { ChartCard } from '../charts/chart-card'
import { Segmented } from '../components/fields/controls'
import { quantity, withUnit } from '../format/number'
import { oneOf, useQueryValue } from '../router/query-value'
import { useTheme } from '../theme'
import { TURNS } from '../walk/player/player-keys'
import { CAMERA } from '../walk/player/view-words'
import { type Cell, cells, extent, type Layer, layerData } from './surface'
import type { SurfaceScene } from './surface-scene'

const LAYER = oneOf<Layer['key']>(['inference', 'table', 'difference'], 'inference')

export function SurfaceView({
  layers,
  name,
  cell,
}: {
  layers: readonly Layer[]
  /** Name of the output. */
  name: string
  cell: Cell
}) {
  const [key, setKey] = useQueryValue('surface', LAYER, 'inference')
  const layer = layers.find((each) => each.key === key) ?? layers[0]
  return (
    <ChartCard
      title={withUnit(`Surface of ${name}`, layer.unit)}
      note="Output over error and current; the ball marks the selected point. Drag to rotate."
      table={() => <Summary layers={layers} />}
      data={() => layerData(layer)}
      tools={
        <Segmented
          label="Surface to show"
          value={key}
          options={layers.map((each) => [each.key, each.title] as const)}
          onChoose={setKey}
        />
      }
    >
      <Stage layer={layer} cell={cell} />
    </ChartCard>
  )
}

function Stage({ layer, cell }: { layer: Layer; cell: Cell }) {
  const stage = useRef<HTMLDivElement>(null)
  const scene = useRef<SurfaceScene | null>(null)
  const [camera, setCamera] = useQueryValue('camera', CAMERA, null)
  const latest = useRef({ layer, cell, camera, setCamera })
  latest.current = { layer, cell, camera, setCamera }
  const [failure, setFailure] = useState<string | null>(null)
  const theme = useTheme()

  useEffect(() => {
    const box = stage.current!
    let observer: ResizeObserver | null = null
    let unmounted = false
    import('./surface-scene')
      .then(({ SurfaceScene }) => {
        if (unmounted) return
        const built = new SurfaceScene(latest.current.layer, latest.current.cell)
        scene.current = built
        box.append(built.canvas)
        describeCanvas(built.canvas, { refresh: () => built.render() })
        const fill = () => box.clientWidth > 0 && built.resize(box.clientWidth, box.clientHeight)
        fill()
        built.look(latest.current.camera)
        built.rig.onPlaced = (place) => latest.current.setCamera(place)
        observer = new ResizeObserver(fill)
        observer.observe(box)
      })
      .catch((error: unknown) => !unmounted && setFailure(messageOf(error)))
    return () => {
      unmounted = true
      observer?.disconnect()
      scene.current?.dispose()
      scene.current = null
    }
  }, [])
  useEffect(() => scene.current?.show(layer, cell), [layer, theme])
  useEffect(() => scene.current?.mark(cell), [cell])

  const press = (event: KeyboardEvent) => {
    const turn = TURNS[event.key]
    if (!turn) return
    event.preventDefault()
    scene.current?.rig.turn(...turn)
  }
  const [low, high] = extent(layer.values)
  return (
    <>
      <div
        class="surface-stage"
        ref={stage}
        tabIndex={0}
        role="application"
        aria-label="The surface in three dimensions; arrow keys rotate it. The maps list its values."
        data-surface={layer.key}
        data-min={low}
        data-max={high}
        data-cells={cells(layer.values)}
        data-handles-keys
        onKeyDown={press}
      >
        {failure !== null && (
          <div class="notice" data-tone="warn" role="alert">
            <strong>Could not draw the surface in three dimensions.</strong>
            <p>
              {failure} Enable hardware acceleration or WebGL in the browser's settings. The maps
              show the same values.
            </p>
          </div>
        )}
      </div>
      <div class="row spread small muted">
        <span>
          From {quantity(low, layer.unit)} to {quantity(high, layer.unit)}.
        </span>
        <button type="button" class="compact" onClick={() => scene.current?.resetView()}>
          Reset view
        </button>
      </div>
    </>
  )
}

/** Ranges of the layers; the maps' tables list the values. */
function Summary({ layers }: { layers: readonly Layer[] }) {
  return (
    <table>
      <caption>The tables of the maps below list all values.</caption>
      <thead>
        <tr>
          <th scope="col">layer</th>
          <th scope="col" class="numeric">
            minimum
          </th>
          <th scope="col" class="numeric">
            maximum
          </th>
        </tr>
      </thead>
      <tbody>
        {layers.map(({ key, title, values, unit }) => (
          <tr key={key}>
            <th scope="row">{title}</th>
            {extent(values).map((value, k) => (
              <td class="numeric" key={k}>
                {quantity(value, unit)}
              </td>
            ))}
          </tr>
        ))}
      </tbody>
    </table>
  )
}
