/** Controller page: a design and its control surface. */

import { useState } from 'preact/hooks'
import { post } from '../api/client'
import { useResource } from '../api/resource'
import { ErrorNotice, Loading } from '../components/feedback'
import { Tabs } from '../components/tabs'
import { formatExact, quantity } from '../format/number'
import { setQuery } from '../router/navigation'
import { DesignHeading, DesignLinks, DesignPage } from '../walk/design/design-page'
import { DesignPicker } from '../walk/design/design-picker'
import { type DesignSource, queryOf, sourceOf, wordOf } from '../walk/design/design-source'
import { type ResolvedDesign, resolveDesign } from '../walk/design/resolve-design'
import './controller.css'
import { DesignCard } from './design-card'
import { FuzzyPanel } from './fuzzy-panel'
import { isLinear, LinearCard } from './linear-card'
import { inputOf, type SurfaceView } from './surface'

/** Points of the grid; odd, so that it includes zero error. */
const GRID = { error_points: 65, current_points: 33 }

export default function ControllerPage() {
  return (
    <DesignPage title="Controller" what="controller" path="/controller" read={sourceOf}>
      {(source, query) => <Controller source={source} query={query} />}
    </DesignPage>
  )
}

function Controller({ source, query }: { source: DesignSource; query: URLSearchParams }) {
  const resolved = useResource(wordOf(source), (signal) => resolveDesign(source, signal))
  const design = resolved.data
  const velocity = Number(query.get('velocity') ?? 0)
  return (
    <div class="stack">
      <DesignHeading title="Controller" path="/controller" design={design} />
      <div class="card walk-choice">
        <DesignPicker
          label="Design"
          chosen={design?.source ?? source}
          chosenLabel={design?.label ?? 'This design'}
          onChoose={(chosen) => setQuery({ ...queryOf(chosen!), velocity: null })}
        />
        <DesignLinks
          source={design?.source ?? source}
          path={design && '/walk'}
          label="Simulate it"
        />
      </div>
      {resolved.error && (
        <ErrorNotice
          what="Could not load the controller."
          error={resolved.error}
          retry={resolved.reload}
        />
      )}
      {resolved.loading && !design && <Loading what="the design" />}
      {design && isLinear(design) && <LinearCard design={design} />}
      {design && !isLinear(design) && (
        <Fuzzy design={design} velocity={Number.isFinite(velocity) ? velocity : 0} />
      )}
      {design && <DesignCard design={design} />}
    </div>
  )
}

function Fuzzy({ design, velocity }: { design: ResolvedDesign; velocity: number }) {
  const key = JSON.stringify([design.controller.name, design.design, velocity])
  const surface = useResource(key, (signal) =>
    post('/v1/controllers/{controller}/surface', {
      path: { controller: design.controller.name },
      body: { design: { ...design.design }, ...GRID, velocity_error: velocity },
      signal,
    }),
  )
  if (surface.error) {
    return (
      <ErrorNotice
        what="Could not compute the fuzzy surface."
        error={surface.error}
        retry={surface.reload}
      />
    )
  }
  if (!surface.data) return <Loading what="the fuzzy surface" />
  return <Outputs surface={surface.data} />
}

function Outputs({ surface }: { surface: SurfaceView }) {
  const { outputs } = surface
  const [name, setName] = useState(outputs[0].name)
  const output = outputs.find((each) => each.name === name) ?? outputs[0]
  const panel = <FuzzyPanel key={output.name} surface={surface} output={output} />
  return (
    <>
      {surface.velocity_error !== null && (
        <VelocityChoice surface={surface} velocity={surface.velocity_error} />
      )}
      {outputs.length === 1 ? (
        panel
      ) : (
        <Tabs
          label="Outputs"
          tabs={outputs.map((each) => ({ key: each.name, label: `${each.name} [${each.unit}]` }))}
          chosen={output.name}
          onChoose={setName}
        >
          {panel}
        </Tabs>
      )}
    </>
  )
}

/** Slider for the velocity error at which the surfaces are evaluated. */
function VelocityChoice({ surface, velocity }: { surface: SurfaceView; velocity: number }) {
  const { range, unit, values } = inputOf(surface, 'velocity')
  return (
    <div class="card field">
      <label for="velocity">Velocity error of the surfaces</label>
      <div class="row">
        <input
          id="velocity"
          type="range"
          min={range[0]}
          max={range[1]}
          step={(range[1] - range[0]) / (values.length - 1)}
          value={velocity}
          aria-valuetext={quantity(velocity, unit)}
          onChange={(event) => setQuery({ velocity: formatted(event.currentTarget.value) })}
        />
        <output for="velocity">{quantity(velocity, unit)}</output>
      </div>
      <span class="hint">
        From {formatExact(range[0])} to {quantity(range[1], unit)}. FzzP does not depend on it.
      </span>
    </div>
  )
}

/** Query value; null for zero. */
function formatted(value: string): string | null {
  return Number(value) === 0 ? null : String(Number(value))
}
