/** The robot walking before there is a job, with the middle of all that is searched. */

import { useRef, useState } from 'preact/hooks'
import type { JobSpec, Scenario } from '../../api/types'
import { useVisible } from '../../components/use-visible'
import { type Design, formatValue } from '../../format/value'
import { sentence } from '../../format/words'
import { RATE, WalkStage } from '../../walk/player/walk-stage'
import { recordWalk } from '../../walk/replay/recorded'
import type { ReplayHeader } from '../../walk/replay/replay'
import { ChoiceField } from '../fields/number-field'

export function StartWalk({
  robot,
  controller,
  design,
  scenarios,
}: {
  robot: JobSpec['robot']
  controller: string
  design: Design
  scenarios: readonly (string | Scenario)[]
}) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [chosen, setChosen] = useState('')
  /** What is walked: not what is typed after it. */
  const [walked, setWalked] = useState<string | null>(null)
  const [ended, setEnded] = useState<ReplayHeader | null>(null)
  const scenario = scenarios.find((entry) => nameOf(entry) === chosen) ?? scenarios[0]
  if (scenario === undefined) {
    return <p class="muted">Choose or add a scenario below to see it walk.</p>
  }
  const name = JSON.stringify([robot, controller, design, scenario])
  return (
    <section class="stack start-walk" aria-label="Start design" ref={box}>
      <div class="fields">
        <ChoiceField
          label="Walk to look at"
          choices={scenarios.map(nameOf)}
          value={nameOf(scenario)}
          hint="with the middle of what is searched"
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
            label="The start design walking"
            visible={visible}
            onWalked={({ header }) => setEnded(header)}
          />
        </div>
      ) : (
        <div class="row">
          <button
            type="button"
            onClick={() => {
              setEnded(null)
              setWalked(name)
            }}
          >
            Let it walk
          </button>
        </div>
      )}
      {walked === name && ended && (
        <p data-ended={ended.status}>
          {ended.status === 'ok'
            ? 'It walks to the end. A job makes it walk better.'
            : `${sentence(ended.explanation)} A job may find a design that walks; else look at stance and actuators in robot.toml.`}
        </p>
      )}
    </section>
  )
}

function nameOf(scenario: string | Scenario): string {
  return typeof scenario === 'string' ? scenario : String(scenario.name)
}
