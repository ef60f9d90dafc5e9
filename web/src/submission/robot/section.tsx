/** Robot of the job: shipped, a variant, or custom. */

import { Card } from '../../components/card'
import { Segmented } from '../../components/fields/controls'
import { ChoiceField, Problems } from '../../components/fields/field'
import { errorsUnder } from '../draft/build-spec'
import type { RobotDraft } from '../draft/draft'
import { SchemaInput } from '../fields/schema-input'
import type { SectionProps } from '../sections/settings'
import { CustomRobotForm } from './custom-robot'
import { ofKind } from './job'

const KINDS = [
  ['shipped', 'Shipped'],
  ['files', 'My robot'],
  ['variant', 'Variant'],
] as const

const LINKS = ['coxa', 'femur', 'tibia']

/** step: whether it is numbered as the first step of a form. */
export function RobotSection({ step = false, ...props }: SectionProps & { step?: boolean }) {
  const { draft, catalogue, errors, onChange } = props
  const { robot } = draft
  const { variant } = catalogue.fields
  const shipped = catalogue.robots.find(({ name }) => name === robot.name)
  const change = (changes: Partial<RobotDraft>) => onChange({ robot: { ...robot, ...changes } })
  const choice = (name: 'contact_law' | 'planned_soles', label: string) => (
    <ChoiceField
      label={label}
      choices={['', ...(variant.get(name)?.choices ?? [])]}
      value={robot[name]}
      error={errors.get(`robot.${name}`)}
      hint={variant.get(name)?.description}
      onChange={(value) => change({ [name]: value })}
    />
  )
  return (
    <Card
      title={
        step ? (
          <>
            <b class="step">1</b> Robot
          </>
        ) : (
          'Robot'
        )
      }
    >
      <div class="stack">
        <Segmented
          roomy
          label="Robot"
          value={robot.kind}
          options={KINDS}
          onChoose={(kind) => onChange(ofKind(draft, kind, catalogue))}
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
            {choice('contact_law', 'Contact law')}
            {choice('planned_soles', 'Planned soles')}
            {LINKS.map((link, index) => (
              <SchemaInput
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
        {robot.kind === 'files' ? (
          // The check reports the same problems.
          <CustomRobotForm {...props} />
        ) : (
          <Problems
            messages={errorsUnder(errors, 'robot').filter(
              (message) =>
                robot.kind !== 'variant' || !/^(backlash|contact_law|planned_soles)/.test(message),
            )}
          />
        )}
      </div>
    </Card>
  )
}
