/** The robot: as it is, a variant of it, or one's own from its files. */

import { useState } from 'preact/hooks'
import { NOT_PUBLISHED } from '../api/robots'
import { Segmented } from '../components/segmented'
import { errorsUnder } from './build-spec'
import { emptyDraft, type RobotDraft } from './draft'
import { ChoiceField, NumberField, Problems } from './number-field'
import { ofKind, withRobotJob } from './robot-job'
import type { SectionProps } from './section'

const KINDS = [
  ['shipped', 'as it ships'],
  ['variant', 'a variant'],
  ['files', 'a robot of one’s own'],
] as const

const LINKS = ['coxa', 'femur', 'tibia']

export function RobotSection(props: SectionProps) {
  const { draft, catalogue, errors, onChange } = props
  const { robot } = draft
  const { variant } = catalogue.fields
  const shipped = catalogue.robots.find(({ name }) => name === robot.name)
  const change = (changes: Partial<RobotDraft>) => onChange({ robot: { ...robot, ...changes } })
  return (
    <section class="card" aria-labelledby="part-robot">
      <h2 id="part-robot">Robot</h2>
      <div class="stack">
        <Segmented
          roomy
          label="Robot"
          value={robot.kind}
          options={KINDS}
          onChoose={(kind) => onChange(ofKind(draft, kind, emptyDraft(catalogue)))}
        />
        {robot.kind !== 'files' && (
          <ChoiceField
            label="Robot that ships"
            choices={catalogue.robots.map(({ name }) => name)}
            value={robot.name}
            hint={shipped?.description}
            onChange={(name) => change({ name })}
          />
        )}
        {robot.kind === 'variant' && (
          <div class="fields">
            <ChoiceField
              label="Law of friction"
              choices={['', ...(variant.get('contact_law')?.choices ?? [])]}
              value={robot.contact_law}
              error={errors.get('robot.contact_law')}
              hint={variant.get('contact_law')?.description}
              onChange={(contact_law) => change({ contact_law })}
            />
            <ChoiceField
              label="Soles that gaits are planned for"
              choices={['', ...(variant.get('planned_soles')?.choices ?? [])]}
              value={robot.planned_soles}
              error={errors.get('robot.planned_soles')}
              hint={variant.get('planned_soles')?.description}
              onChange={(planned_soles) => change({ planned_soles })}
            />
            {LINKS.map((link, index) => (
              <NumberField
                key={link}
                label={`Backlash of the ${link}`}
                field={{ ...variant.get('backlash')!, unit: 'deg' }}
                value={robot.backlash[index]}
                error={errors.get(`robot.backlash.${index}`)}
                onChange={(value) =>
                  change({ backlash: robot.backlash.map((old, k) => (k === index ? value : old)) })
                }
              />
            ))}
          </div>
        )}
        {robot.kind === 'files' && (
          <div class="fields">
            <FileField
              name="robot.toml"
              text={robot.toml}
              accept=".toml"
              onText={(toml) => change({ toml })}
            />
            <FileField
              name="robot.urdf"
              text={robot.urdf}
              accept=".urdf,.xml"
              onText={(urdf) => change({ urdf })}
            />
            <JobFile {...props} />
          </div>
        )}
        {robot.kind === 'files' && (
          <p class="muted small">
            <code>gaitswarm robot init FILE.urdf --output FOLDER</code> makes all three files.{' '}
            {NOT_PUBLISHED}
          </p>
        )}
        <Problems
          messages={errorsUnder(errors, 'robot').filter(
            (message) =>
              robot.kind !== 'variant' || !/^(backlash|contact_law|planned_soles)/.test(message),
          )}
        />
      </div>
    </section>
  )
}

/** The robot's own scenarios, controller and variables take the place of Szabadka-II's. */
function JobFile({ draft, catalogue, onChange }: SectionProps) {
  const [text, setText] = useState('')
  const [wrong, setWrong] = useState<string | undefined>()
  const read = (found: string) => {
    try {
      onChange(withRobotJob(draft, catalogue, found))
      setText(found)
      setWrong(undefined)
    } catch (error) {
      setWrong(error instanceof Error ? error.message : String(error))
    }
  }
  return (
    <FileField
      name="job.json"
      text={text}
      accept=".json"
      optional="its scenarios, controller and variables"
      error={wrong}
      onText={read}
    />
  )
}

function FileField({
  name,
  text,
  accept,
  optional,
  error,
  onText,
}: {
  name: string
  text: string
  accept: string
  /** What is in it, of a file that can be left out. */
  optional?: string
  error?: string
  onText: (text: string) => void
}) {
  const id = `file-${name.replace('.', '-')}`
  return (
    <div class="field">
      <label for={id}>{name}</label>
      <input
        id={id}
        type="file"
        accept={accept}
        aria-invalid={error !== undefined}
        onChange={async (event) => {
          const file = event.currentTarget.files?.[0]
          if (file) onText(await file.text())
        }}
      />
      <span class="hint">
        {text === ''
          ? (optional ?? 'not chosen yet')
          : `${text.length.toLocaleString('en')} characters read`}
      </span>
      {error !== undefined && (
        <span class="wrong" role="alert">
          {error}
        </span>
      )}
    </div>
  )
}
