/** Choice of a scenario: the job's, and the presets. */

import { useId } from 'preact/hooks'
import type { Scenario, ScenarioPreset } from '../../api/types'
import { formatExact } from '../../format/number'

export function ScenarioPicker({
  jobScenarios,
  presets,
  chosen,
  onChoose,
}: {
  /** Scenarios of the design's job. */
  jobScenarios: readonly Scenario[]
  presets: readonly ScenarioPreset[]
  /** Name of the chosen scenario. */
  chosen: string
  onChoose: (name: string) => void
}) {
  const id = useId()
  const names = new Set(jobScenarios.map(({ name }) => name))
  const others = presets.filter(({ name }) => !names.has(name))
  return (
    <div class="field">
      <label for={id}>Scenario</label>
      <select id={id} value={chosen} onChange={(event) => onChoose(event.currentTarget.value)}>
        {jobScenarios.length > 0 && (
          <optgroup label="Job">
            {jobScenarios.map((scenario) => (
              <option key={scenario.name} value={scenario.name}>
                {described(scenario)}
              </option>
            ))}
          </optgroup>
        )}
        {others.length > 0 && (
          <optgroup label={jobScenarios.length > 0 ? 'Other presets' : 'Presets'}>
            {others.map((scenario) => (
              <option key={scenario.name} value={scenario.name}>
                {described(scenario)}
              </option>
            ))}
          </optgroup>
        )}
      </select>
    </div>
  )
}

/** Name of a scenario with its distinguishing parameters. */
function described(scenario: Scenario | ScenarioPreset): string {
  const { name, cycle_time, load, slope, turn, direction, drop, stuck_leg, shove } = scenario
  const parts = [`cycle ${formatExact(cycle_time)} s`]
  if (load) parts.push(`load ${formatExact(load)} kg`)
  if (slope) parts.push(`slope ${formatExact(slope)}°`)
  if (direction === 'backward') parts.push('backward')
  if (drop) parts.push(`drop ${formatExact(drop * 1e3)} mm`)
  if (stuck_leg) parts.push(`${stuck_leg.replaceAll('_', ' ')} leg stuck`)
  if (shove) parts.push(`shove ${formatExact(shove)} N s`)
  if (turn) parts.push(`turn ${formatExact(turn)}`)
  return `${name} (${parts.join(', ')})`
}
