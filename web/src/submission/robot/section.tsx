/** Robot of the job: shipped, a variant, or custom. */

import { Segmented } from '../../components/fields/segmented'
import { errorsUnder } from '../draft/build-spec'
import { emptyDraft, type RobotDraft } from '../draft/draft'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import type { SectionProps } from '../sections/section'
import { CustomRobotForm } from './custom-robot'
import { ofKind } from './job'

const KINDS = [
  ['shipped', 'shipped'],
  ['variant', 'variant'],
  ['files', 'custom'],
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
            label="Shipped robot"
            choices={catalogue.robots.map(({ name }) => name)}
            value={robot.name}
            hint={shipped?.description}
            onChange={(name) => change({ name })}
          />
        )}
        {robot.kind === 'variant' && (
          <div class="fields">
            <ChoiceField
              label="Contact law"
              choices={['', ...(variant.get('contact_law')?.choices ?? [])]}
              value={robot.contact_law}
              error={errors.get('robot.contact_law')}
              hint={variant.get('contact_law')?.description}
              onChange={(contact_law) => change({ contact_law })}
            />
            <ChoiceField
              label="Planned soles"
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
        {robot.kind === 'files' && <CustomRobotForm {...props} />}
        <Problems
          messages={errorsUnder(errors, 'robot').filter((message) =>
            robot.kind === 'files'
              ? robot.urdf !== ''
              : robot.kind !== 'variant' || !/^(backlash|contact_law|planned_soles)/.test(message),
          )}
        />
      </div>
    </section>
  )
}
