/** Simulation of the preview design of a custom robot. */

import { useRef, useState } from 'preact/hooks'
import type { JobSpec, Scenario } from '../../api/types'
import { ChoiceField } from '../../components/fields/field'
import { useVisible } from '../../components/use-visible'
import { type Design, formatValue } from '../../format/value'
import { sentence } from '../../format/words'
import { RATE, WalkStage } from '../../walk/player/walk-stage'
import { type ReplayHeader, recordWalk } from '../../walk/replay/replay'

interface StartWalkProps {
  robot: JobSpec['robot']
  controller: string
  design: Design
  scenarios: readonly (string | Scenario)[]
}

export function StartWalk({ robot, controller, design, scenarios }: StartWalkProps) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [chosen, setChosen] = useState('')
  /** What was simulated, regardless of later edits. */
  const [walked, setWalked] = useState<string | null>(null)
  const [finished, setFinished] = useState<ReplayHeader | null>(null)
  const scenario = scenarios.find((entry) => nameOf(entry) === chosen) ?? scenarios[0]
  if (scenario === undefined) {
    return <p class="muted">Choose or add a scenario below to simulate it.</p>
  }
  const name = JSON.stringify([robot, controller, design, scenario])
  return (
    <section class="stack start-walk" aria-label="Start design" ref={box}>
      <div class="fields">
        <ChoiceField
          label="Scenario to simulate"
          choices={scenarios.map(nameOf)}
          value={nameOf(scenario)}
          hint="with the middle of the search space"
          onChange={setChosen}
        />
      </div>
      <p class="small muted">
        {controller}:{' '}
        {Object.entries(design)
          .map(([variable, value]) => `${variable} ${formatValue(value)}`)
          .join(', ')}
      </p>
      {walked === name ? (
        <div class="walk-preview">
          <WalkStage
            name={name}
            record={(signal) =>
              recordWalk(
                { label: 'start', robot, controller: { name: controller }, design },
                scenario,
                RATE,
                signal,
              )
            }
            label="Replay of the preview design"
            visible={visible}
            onWalked={({ header }) => setFinished(header)}
          />
        </div>
      ) : (
        <div class="row">
          <button
            type="button"
            onClick={() => {
              setFinished(null)
              setWalked(name)
            }}
          >
            Simulate
          </button>
        </div>
      )}
      {walked === name && finished && (
        <p data-ended={finished.status}>
          {finished.status === 'ok'
            ? 'The simulation succeeded. A job can improve the gait.'
            : `${sentence(finished.explanation)} A job may find a design that succeeds; otherwise check stance and actuators in robot.toml.`}
        </p>
      )}
    </section>
  )
}

function nameOf(scenario: string | Scenario): string {
  return typeof scenario === 'string' ? scenario : String(scenario.name)
}
