/** Surface, rules, table and membership functions of one fuzzy output. */

import { useMemo, useState } from 'preact/hooks'
import { HeatMap } from './heat-map'
import { MembershipChart } from './membership-chart'
import { QuantisationCard } from './quantisation-card'
import { RulesCard } from './rules-card'
import {
  type Cell,
  firstCell,
  indexOf,
  layersOf,
  type Output,
  type SurfaceView as Surface,
} from './surface'
import { SurfaceView } from './surface-view'

export function FuzzyPanel({ surface, output }: { surface: Surface; output: Output }) {
  const layers = useMemo(() => layersOf(surface, output), [surface, output])
  const [chosen, setChosen] = useState<Cell | null>(null)
  const cell = chosen ?? firstCell(layers[0])
  return (
    <div class="stack">
      <div class="grid fuzzy-grid">
        <SurfaceView layers={layers} name={output.name} cell={cell} />
        <RulesCard surface={surface} output={output} cell={cell} />
      </div>
      <QuantisationCard output={output} />
      <div class="grid maps">
        {layers.map((layer) => (
          <HeatMap key={layer.key} layer={layer} cell={cell} onCell={setChosen} />
        ))}
      </div>
      <div class="grid maps">
        {surface.inputs.map((input) => (
          <MembershipChart
            key={input.name}
            universe={input}
            side="Input"
            marker={input.values[indexOf(input, surface, cell)]}
          />
        ))}
        <MembershipChart
          universe={output}
          side="Output"
          marker={output.inference[cell.error][cell.current]}
        />
      </div>
    </div>
  )
}
