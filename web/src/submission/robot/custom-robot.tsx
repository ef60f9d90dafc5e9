/** Custom robot from a URDF, xacro or MJCF file; guessed settings are shown and can be edited. */

import { NOT_PUBLISHED } from '../../api/jobs'
import type { CheckedLeg, RobotCheck } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { ChoiceField, FileField, TextField } from '../../components/fields/field'
import { type Column, Table } from '../../components/table/table'
import { exactQuantity, formatExact, quantity } from '../../format/number'
import { useManual } from '../../session/session'
import { specOf } from '../draft/build-spec'
import { variablesOf } from '../draft/catalogue'
import type { SectionProps } from '../sections/settings'
import { ROBOT_FILES, startDesign } from './job'
import { StartWalk } from './start-walk'
import { type ActuatorChoice, useCustomRobot } from './use-custom-robot'

const ACTUATORS = ['auto', 'dc', 'torque'] as const satisfies readonly ActuatorChoice[]

const HINTS = [
  ['locks', 'Held joints', '*_arm=0.5 head=0', 'JOINT=ANGLE [rad]; surplus joints are held anyway'],
  ['feet', 'Feet', '*_calf=0,0,-0.2', 'LINK=X,Y,Z, the end of a leg in the link’s frame [m]'],
  ['mass', 'Mass [kg]', '', 'of the robot, to which all masses are scaled'],
  ['actuators', 'Listed actuators', '*=mx64 *_coxa=mx106', 'JOINT=NAME'],
] as const

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
      <section
        class="drop"
        aria-label="Drop zone of the robot"
        onDragOver={(event) => event.preventDefault()}
        onDrop={(event) => {
          event.preventDefault()
          const file = event.dataTransfer?.files[0]
          if (file) state.chooseUrdf(file)
        }}
      >
        <FileField
          label="URDF, xacro or MJCF"
          accept={ROBOT_FILES}
          hint={
            robot.urdf === ''
              ? 'Choose the file or drop it here. Meshes are not needed.'
              : (state.urdf?.name ?? 'as before')
          }
          onFile={state.chooseUrdf}
        />
        <p class="muted small">
          2 to 32 legs with three revolute joints each; wheels, arms and surplus joints are held. A
          file that includes others needs <code>gaitswarm robot init</code>. Nothing is stored
          before the job is submitted. {NOT_PUBLISHED}
        </p>
      </section>
      <details>
        <summary>Actuators, robot.toml and job.json</summary>
        <div class="fields">
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
      </details>
      <details open={state.problem !== null && robot.toml === ''}>
        <summary>Held joints, feet, masses</summary>
        <div class="fields">
          {HINTS.map(([name, label, placeholder, hint]) => (
            <TextField
              key={name}
              label={label}
              placeholder={placeholder}
              hint={hint}
              value={state.hints[name]}
              onChange={(text) => state.setHints({ [name]: text })}
            />
          ))}
        </div>
        <p class="muted small">
          Names may have the wildcards * and ?; separate entries by spaces, and generate robot.toml.
        </p>
      </details>
      {state.problem && (
        <>
          <ErrorNotice {...state.problem} />
          <p class="small">
            {robot.toml === ''
              ? 'Choose another file, give held joints or feet, or provide a robot.toml with it.'
              : 'Edit robot.toml below and check again, or choose another file.'}{' '}
            {manual && <a href="/manual/docs/robot-errors.html">Errors and remedies</a>}
          </p>
        </>
      )}
      {robot.toml !== '' && (
        <details open={state.problem !== null}>
          <summary>
            robot.toml: settings missing in the URDF, with comments on guessed values
          </summary>
          <TextField
            label={<span class="visually-hidden">Text of robot.toml</span>}
            class="robot-text"
            rows={14}
            spellcheck={false}
            value={robot.toml}
            onChange={(toml) => onChange({ robot: { ...robot, toml } })}
          />
        </details>
      )}
      <div class="row">
        {robot.toml !== '' && (
          <button
            type="button"
            disabled={state.busy !== null || robot.urdf === ''}
            onClick={state.check}
          >
            {checked ? 'Check the robot again' : 'Check the robot'}
          </button>
        )}
        {state.urdf && (
          <button type="button" disabled={state.busy !== null} onClick={state.propose}>
            {robot.toml === '' ? 'Generate robot.toml' : 'Regenerate robot.toml'}
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

const LEG_COLUMNS: readonly Column<CheckedLeg>[] = [
  { key: 'leg', value: ({ name }) => name, header: true },
  { key: 'joints', cell: ({ joints }) => joints.join(', '), minor: true },
  { key: 'foot', value: ({ foot }) => foot },
  { key: 'length', unit: 'm', digits: 3, value: ({ length }) => length },
  { key: 'reach', unit: 'm', digits: 3, value: ({ reach }) => reach },
]

/** Results of a robot's check: mass, legs, stance, warnings and guesses. */
function Findings({ check, guesses }: { check: RobotCheck; guesses: readonly string[] }) {
  const { standing } = check
  const fixedJoints = Object.entries(check.held)
  return (
    <section class="stack" aria-label="Check results" data-warnings={check.warnings.length}>
      <p>
        <strong>{check.name}</strong>: {check.legs.length} legs, {check.joints} joints,{' '}
        {quantity(check.mass, 'kg')}. After standing for {exactQuantity(standing.seconds, 's')}, its
        soles carry {quantity(standing.normal_forces, 'N')} of {quantity(standing.weight, 'N')}; its
        body is at {quantity(standing.height, 'm', 3)}.
        {fixedJoints.length > 0 &&
          ` Fixed joints: ${fixedJoints.map(([name, at]) => `${name} at ${formatExact(at)} rad`).join(', ')}.`}
      </p>
      {check.warnings.length > 0 && (
        <div class="notice" data-tone="warn">
          <strong>Warnings (the job can still be submitted)</strong>
          <ul>
            {check.warnings.map((warning) => (
              <li key={warning}>{warning}</li>
            ))}
          </ul>
        </div>
      )}
      <Table caption="Legs" columns={LEG_COLUMNS} rows={check.legs} />
      {guesses.length > 0 && (
        <details>
          <summary>{guesses.length} guessed values, to be verified in robot.toml</summary>
          <ul>
            {guesses.map((guess) => (
              <li key={guess}>{guess}</li>
            ))}
          </ul>
        </details>
      )}
    </section>
  )
}
