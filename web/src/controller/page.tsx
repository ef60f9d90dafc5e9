/** Controller page: a design and its control surface. */

import { useState } from 'preact/hooks'
import { post } from '../api/client'
import { useResource } from '../api/resource'
import type { Variable } from '../api/types'
import { Card, Loaded } from '../components/card'
import { Segmented } from '../components/fields/controls'
import { Table } from '../components/table/table'
import { formatExact, quantity, writtenUnit } from '../format/number'
import { formatExactValue } from '../format/value'
import { inWords } from '../format/words'
import { setQuery } from '../router/navigation'
import { ofLegGroups, variablesOf } from '../submission/draft/catalogue'
import { DesignHeading, DesignLinks, DesignPage } from '../walk/design/design-page'
import { DesignPicker } from '../walk/design/design-picker'
import { type DesignSource, queryOf, sourceOf, wordOf } from '../walk/design/design-source'
import { type ResolvedDesign, resolveDesign } from '../walk/design/resolve-design'
import './controller.css'
import { FuzzyPanel } from './fuzzy-panel'
import { inputOf, type SurfaceView } from './surface'

/** Points of the grid; odd, so that it includes zero error. */
const GRID = { error_points: 65, current_points: 33 }

export default function ControllerPage() {
  return (
    <DesignPage title="Controller" path="/controller" read={sourceOf}>
      {(source, query) => <Controller source={source} query={query} />}
    </DesignPage>
  )
}

function Controller({ source, query }: { source: DesignSource; query: URLSearchParams }) {
  const resolved = useResource(wordOf(source), (signal) => resolveDesign(source, signal))
  const { data } = resolved
  const velocity = Number(query.get('velocity') ?? 0)
  return (
    <div class="stack">
      <DesignHeading title="Controller" path="/controller" design={data} />
      <div class="card walk-choice">
        <DesignPicker
          label="Design"
          chosen={data?.source ?? source}
          chosenLabel={data?.label ?? 'This design'}
          onChoose={(chosen) => setQuery({ ...queryOf(chosen!), velocity: null })}
        />
        <DesignLinks source={data?.source ?? source} path={data && '/walk'} label="Simulate it" />
      </div>
      <Loaded resource={resolved} what="the design" failed="Could not load the controller.">
        {(design) => (
          <>
            {isLinear(design) ? (
              <>
                <ControlLaw design={design} />
                <DesignCard design={design} />
              </>
            ) : (
              <Fuzzy design={design} velocity={Number.isFinite(velocity) ? velocity : 0} />
            )}
          </>
        )}
      </Loaded>
    </div>
  )
}

function Fuzzy({ design, velocity }: { design: ResolvedDesign; velocity: number }) {
  const key = JSON.stringify([design.controller.name, design.design, velocity])
  const surface = useResource(
    key,
    (signal) =>
      post('/v1/controllers/{controller}/surface', {
        path: { controller: design.controller.name },
        body: { design: { ...design.design }, ...GRID, velocity_error: velocity },
        signal,
      }),
    { keep: true },
  )
  return (
    <>
      <Loaded
        resource={surface}
        what="the fuzzy surface"
        failed="Could not compute the fuzzy surface."
      >
        {(data) => <Outputs surface={data} />}
      </Loaded>
      {/* Below the surface, which would move it. */}
      {(surface.data || surface.error) && <DesignCard design={design} />}
    </>
  )
}

function Outputs({ surface }: { surface: SurfaceView }) {
  const { outputs } = surface
  const [name, setName] = useState(outputs[0].name)
  const output = outputs.find((each) => each.name === name) ?? outputs[0]
  return (
    <>
      {surface.velocity_error !== null && (
        <VelocityChoice surface={surface} velocity={surface.velocity_error} />
      )}
      {outputs.length > 1 && (
        <Segmented
          roomy
          label="Output"
          value={output.name}
          options={outputs.map(({ name, unit }) => [name, `${name} [${unit}]`] as const)}
          onChoose={setName}
        />
      )}
      <FuzzyPanel key={output.name} surface={surface} output={output} />
    </>
  )
}

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
          onChange={({ currentTarget: { value } }) =>
            setQuery({ velocity: Number(value) === 0 ? null : String(Number(value)) })
          }
        />
        <output for="velocity">{quantity(velocity, unit)}</output>
      </div>
      <span class="hint">
        From {formatExact(range[0])} to {quantity(range[1], unit)}. FzzP does not depend on it.
      </span>
    </div>
  )
}

/** Terms of a linear control law, and their meanings, by gain. */
const TERMS: Readonly<Record<string, readonly [term: string, meaning: string]>> = {
  P: ['error', 'responds immediately, in proportion to the angle error'],
  I: ['∫ error dt', 'grows as long as an error persists, and thus removes it'],
  D: ['d error / dt', 'responds to the rate of change of the error, and thus damps'],
}

/** Whether a controller has only gains, and hence no fuzzy surface. */
function isLinear({ controller }: ResolvedDesign): boolean {
  return controller.variables.every(({ name }) => name in TERMS)
}

function ControlLaw({ design: { controller, design } }: { design: ResolvedDesign }) {
  const gains = Object.keys(TERMS).filter((gain) => gain in design)
  return (
    <Card
      title="Control law"
      note="This controller is linear: it has no rules, hence no fuzzy surface and no table. Its output does not depend on the motor current."
      data={{ 'data-linear': controller.name }}
    >
      <p class="law">
        PWM ={' '}
        {gains.map((gain, k) => (
          <span key={gain}>
            {k > 0 && ' + '}
            <b>{formatExactValue(design[gain])}</b> · {TERMS[gain][0]}
          </span>
        ))}
      </p>
      <ul>
        {gains.map((gain) => (
          <li key={gain}>
            <b>{gain}</b> = {formatExactValue(design[gain])}{' '}
            <span class="unit">{controller.variables.find(({ name }) => name === gain)?.unit}</span>
            : {TERMS[gain][1]}.
          </li>
        ))}
      </ul>
      <p class="muted">
        To see a surface, choose a fuzzy design above, for example{' '}
        <a href="/controller?controller=fuzzy-pi&published=A">the published optimum A</a>.
      </p>
    </Card>
  )
}

function DesignCard({ design: { controller, design } }: { design: ResolvedDesign }) {
  const common = variablesOf(controller)
  const variables = [...common, ...ofLegGroups(common, Object.keys(design))]
  return (
    <Card title="Design" note={controller.description}>
      <Table<Variable>
        caption="Design values"
        columns={[
          { key: 'variable', header: true, value: ({ name }) => name },
          { key: 'value', numeric: true, cell: ({ name }) => formatExactValue(design[name]) },
          { key: 'unit', cell: ({ unit }) => (unit === '1' ? '' : writtenUnit(unit)) },
          { key: 'search bounds', numeric: true, minor: true, cell: searched },
          { key: 'meaning', cell: ({ description }) => description },
        ]}
        rows={variables.filter(({ name }) => name in design)}
      />
    </Card>
  )
}

function searched({ low, high, choices = [] }: Variable): string {
  if (choices.length > 0) return choices.map(inWords).join(', ')
  return `${formatExact(low)} to ${formatExact(high)}`
}
