/** Interactive three-dimensional view of a control surface. */

import { useEffect, useRef } from 'preact/hooks'
import { describeCanvas } from '../charts/canvas'
import { ChartCard } from '../charts/chart-card'
import { Segmented } from '../components/fields/controls'
import { Table } from '../components/table/table'
import { quantity, withUnit } from '../format/number'
import { oneOf, useQueryValue } from '../router/query-value'
import { useTheme } from '../theme'
import { TURNS } from '../walk/player/player-keys'
import { NoScene, useStage } from '../walk/player/use-scene'
import { CAMERA } from '../walk/player/view-words'
import { type Cell, cells, extent, type Layer, layerData } from './surface'
import type { SurfaceScene } from './surface-scene'

const LAYER = oneOf<Layer['key']>(['inference', 'table', 'difference'], 'inference')

interface SurfaceViewProps {
  layers: readonly Layer[]
  name: string
  cell: Cell
}

export function SurfaceView({ layers, name, cell }: SurfaceViewProps) {
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
  const box = useRef<HTMLDivElement>(null)
  const [camera, setCamera] = useQueryValue('camera', CAMERA, null)
  const theme = useTheme()
  const load = async () => {
    const { SurfaceScene } = await import('./surface-scene')
    return () => new SurfaceScene(layer, cell)
  }
  const onBuilt = (built: SurfaceScene) => {
    describeCanvas(built.canvas, { refresh: () => built.render() })
    built.look(camera)
    built.rig.onPlaced = setCamera
  }
  const { scene, failure } = useStage(box, load, onBuilt, [])
  useEffect(() => scene?.show(layer, cell), [scene, layer, theme])
  useEffect(() => scene?.mark(cell), [scene, cell])

  const press = (event: KeyboardEvent) => {
    const turn = TURNS[event.key]
    if (!turn) return
    event.preventDefault()
    scene?.rig.turn(...turn)
  }
  const [low, high] = extent(layer.values)
  return (
    <>
      <div
        class="surface-stage"
        ref={box}
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
          <NoScene what="surface" reason={failure} rest="The maps show the same values." />
        )}
      </div>
      <div class="row spread small muted">
        <span>
          From {quantity(low, layer.unit)} to {quantity(high, layer.unit)}.
        </span>
        <button type="button" class="compact" onClick={() => scene?.resetView()}>
          Reset view
        </button>
      </div>
    </>
  )
}

function Summary({ layers }: { layers: readonly Layer[] }) {
  return (
    <>
      <p>The tables of the maps below list all values.</p>
      <Table
        caption="Ranges of the layers"
        columns={[
          { key: 'layer', header: true, value: ({ title }) => title },
          ...['minimum', 'maximum'].map((key, k) => ({
            key,
            numeric: true,
            value: ({ values }: Layer) => extent(values)[k],
            cell: ({ values, unit }: Layer) => quantity(extent(values)[k], unit),
          })),
        ]}
        rows={layers}
      />
    </>
  )
}
