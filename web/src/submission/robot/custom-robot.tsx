/** Custom robot from a URDF; guessed settings are shown and can be edited. */

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
import { type ActuatorChoice, useCustomRobot } from './use-custom-robot'

const ACTUATORS = ['auto', 'dc', 'torque'] as const satisfies readonly ActuatorChoice[]

const BUSY = {
  proposing: 'Detecting legs, stance and actuators…',
  checking: 'Simulating one second of standing…',
}

export function CustomRobotForm({ draft, catalogue, onChange }: SectionProps) {
  const state = useCustomRobot(draft, catalogue, onChange)
  const { robot } = draft
  const { checked } = state
  const manual = useManual()
  const current =
    checked !== null && checked.robot.toml === robot.toml && checked.robot.urdf === robot.urdf
  const spec = specOf(draft)
  const controller = catalogue.controllers.find(({ name }) => name === draft.controller)
  return (
    <>
      <div class="fields">
        <FileField
          label="URDF"
          accept=".urdf,.xml"
          hint={state.urdf?.name ?? (robot.urdf === '' ? 'required' : 'from the job')}
          missing={robot.urdf === ''}
          onFile={state.chooseUrdf}
        />
        <ChoiceField
          label="Actuators"
          choices={ACTUATORS}
          value={state.actuator}
          hint="of the proposal: auto decides by the URDF’s torques and rates"
          onChange={(actuator) => state.chooseActuator(actuator as ActuatorChoice)}
        />
        <FileField
          label="robot.toml"
          accept=".toml"
          hint={state.toml?.name ?? 'optional; generated from the URDF by default'}
          onFile={state.chooseToml}
        />
        <FileField
          label="job.json"
          accept=".json"
          hint={state.job?.name ?? 'optional; scenarios, controller and variables'}
          onFile={state.chooseJob}
        />
      </div>
      <p class="muted small">
        2 to 32 legs with three revolute joints each. Meshes are not needed. Nothing is stored
        before the job is submitted. {NOT_PUBLISHED}
      </p>
      {state.problem && (
        <>
          <ErrorNotice {...state.problem} />
          <p class="small">
            Choose another URDF, provide a robot.toml, or edit the one below and check again.{' '}
            {manual && <a href="/manual/docs/robots.html">Requirements for robots</a>}
          </p>
        </>
      )}
      <Toml text={robot.toml} onText={(toml) => onChange({ robot: { ...robot, toml } })} />
      <div class="row">
        <button
          type="button"
          disabled={state.busy !== null || robot.toml === '' || robot.urdf === ''}
          onClick={state.check}
        >
          {checked ? 'Check the robot again' : 'Check the robot'}
        </button>
        {state.urdf && (
          <button type="button" disabled={state.busy !== null} onClick={state.propose}>
            Regenerate robot.toml
          </button>
        )}
        <span class="muted" role="status">
          {state.busy ? BUSY[state.busy] : checked && !current && 'Modified since the last check.'}
        </span>
      </div>
      {current && checked && (
        <>
          <Findings check={checked.check} guesses={state.guesses} />
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
      <summary>robot.toml: settings missing in the URDF, with comments on guessed values</summary>
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
