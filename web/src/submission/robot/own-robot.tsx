/** A robot of one's own: its URDF is enough; what was guessed is shown, and can be changed. */

import { useId } from 'preact/hooks'
import { NOT_PUBLISHED } from '../../api/robots'
import { ErrorNotice } from '../../components/feedback'
import { useManual } from '../../session/session'
import { specOf } from '../draft/build-spec'
import { variablesOf } from '../draft/catalogue'
import { ChoiceField } from '../fields/number-field'
import type { SectionProps } from '../sections/section'
import { FileField } from './file-field'
import { Findings } from './findings'
import { startDesign } from './start-design'
import { StartWalk } from './start-walk'
import { type ActuatorChoice, useOwnRobot } from './use-own-robot'

const ACTUATORS = ['auto', 'dc', 'torque'] as const satisfies readonly ActuatorChoice[]

const BUSY = {
  proposing: 'Looking for legs, a stance and actuators…',
  checking: 'Letting it stand for a second…',
}

export function OwnRobot({ draft, catalogue, onChange }: SectionProps) {
  const own = useOwnRobot(draft, catalogue, onChange)
  const { robot } = draft
  const { seen } = own
  const manual = useManual()
  const current = seen !== null && seen.robot.toml === robot.toml && seen.robot.urdf === robot.urdf
  const spec = specOf(draft)
  const controller = catalogue.controllers.find(({ name }) => name === draft.controller)
  return (
    <>
      <div class="fields">
        <FileField
          label="URDF"
          accept=".urdf,.xml"
          hint={own.urdf?.name ?? (robot.urdf === '' ? 'all that is needed' : 'the job’s own')}
          missing={robot.urdf === ''}
          onFile={own.chooseUrdf}
        />
        <ChoiceField
          label="Actuators"
          choices={ACTUATORS}
          value={own.actuator}
          hint="that are proposed: auto decides by the URDF’s torques and rates"
          onChange={(actuator) => own.chooseActuator(actuator as ActuatorChoice)}
        />
        <FileField
          label="robot.toml"
          accept=".toml"
          hint={own.toml?.name ?? 'optional; proposed from the URDF if there is none'}
          onFile={own.chooseToml}
        />
        <FileField
          label="job.json"
          accept=".json"
          hint={own.job?.name ?? 'optional; its scenarios, controller and variables'}
          onFile={own.chooseJob}
        />
      </div>
      <p class="muted small">
        Legs of three joints that turn, 2 to 32 of them. Meshes are not needed. Nothing is kept
        before the job is submitted. {NOT_PUBLISHED}
      </p>
      {own.problem && (
        <>
          <ErrorNotice {...own.problem} />
          <p class="small">
            Choose another URDF, bring a robot.toml of your own, or change the one below and check
            again. {manual && <a href="/manual/docs/robots.html">What a robot needs</a>}
          </p>
        </>
      )}
      <Toml text={robot.toml} onText={(toml) => onChange({ robot: { ...robot, toml } })} />
      <div class="row">
        <button
          type="button"
          disabled={own.busy !== null || robot.toml === '' || robot.urdf === ''}
          onClick={own.check}
        >
          {seen ? 'Check the robot again' : 'Check the robot'}
        </button>
        {own.urdf && (
          <button type="button" disabled={own.busy !== null} onClick={own.propose}>
            Propose robot.toml anew
          </button>
        )}
        <span class="muted" role="status">
          {own.busy ? BUSY[own.busy] : seen && !current && 'It was changed since it was checked.'}
        </span>
      </div>
      {current && seen && (
        <>
          <Findings check={seen.check} guesses={own.guesses} />
          <StartWalk
            robot={spec.robot}
            controller={draft.controller}
            design={startDesign(spec, variablesOf(controller))}
            scenarios={spec.scenarios ?? []}
          />
        </>
      )}
    </>
  )
}

function Toml({ text, onText }: { text: string; onText: (text: string) => void }) {
  const id = useId()
  if (text === '') return null
  return (
    <details open>
      <summary>robot.toml: all that a URDF does not say, with a comment on every guess</summary>
      <div class="field">
        <label class="visually-hidden" for={id}>
          Text of robot.toml
        </label>
        <textarea
          id={id}
          class="robot-text"
          rows={14}
          spellcheck={false}
          value={text}
          onInput={(event) => onText(event.currentTarget.value)}
        />
      </div>
    </details>
  )
}
