/** The job of a fit: what is fitted and by which method, what it will cost, and its submission. */

import type { ComponentChildren } from 'preact'
import { useState } from 'preact/hooks'
import { ApiProblem } from '../../api/problem'
import type { AnySpec } from '../../api/types'
import type { Catalogue } from '../catalogue'
import { useFirstProblem } from '../first-problem'
import { JsonForm } from '../json-form'
import { ChoiceField, Problems } from '../number-field'
import { SubmitPanel } from '../submit-panel'
import { TextField } from '../text-field'
import { useSubmission } from '../use-submission'
import { errorsByPart, type FitDraft, hasParticles } from './fit'

export function FitForm({
  title,
  catalogue,
  robot,
  onRobot,
  draft,
  onDraft,
  spec,
  parts,
  before,
  children,
}: {
  title: string
  catalogue: Catalogue
  robot: string
  onRobot: (name: string) => void
  draft: FitDraft
  onDraft: (changes: Partial<FitDraft>) => void
  spec: AnySpec
  /** Parts of the spec that are no fields here, whose problems are told together. */
  parts: readonly string[]
  /** What stands before the fields. */
  before?: ComponentChildren
  /** Fields of the kind's own, given the problems by part. */
  children?: (errors: Readonly<Record<string, string>>) => ComponentChildren
}) {
  const [asJson, setAsJson] = useState(false)
  const submission = useSubmission(spec)
  const { problem } = submission
  const errors = errorsByPart(problem instanceof ApiProblem ? problem.errors : [])
  useFirstProblem(submission.attempts)
  if (asJson) return <JsonForm spec={spec} onBack={() => setAsJson(false)} />
  const field = (name: Exclude<keyof FitDraft, 'method'>, label: string, hint: string) => (
    <TextField
      label={label}
      value={draft[name]}
      hint={hint}
      error={errors[name]}
      wide={name === 'variables'}
      onChange={(value) => onDraft({ [name]: value })}
    />
  )
  return (
    <form
      class="submission"
      noValidate
      onSubmit={(event) => {
        event.preventDefault()
        submission.submit()
      }}
    >
      <section class="card stack" aria-labelledby="part-fit">
        <h2 id="part-fit">{title}</h2>
        <Problems messages={parts.flatMap((part) => (errors[part] ? [errors[part]] : []))} />
        {before}
        <div class="fields">
          {field('name', 'Name', 'shown in the list of jobs')}
          <ChoiceField
            label="Robot"
            choices={catalogue.robots.map(({ name }) => name)}
            value={robot}
            error={errors.robot}
            onChange={onRobot}
          />
          {field(
            'variables',
            'Parameters',
            'names, separated by commas; body_mass=3:5 for bounds, contact_law=stick:dead_zone for choices; empty: all of the robot’s',
          )}
          {children?.(errors)}
          <ChoiceField
            label="Method"
            choices={catalogue.optimizers.map(({ settings }) => settings.name)}
            value={draft.method}
            error={errors.optimizer}
            onChange={(method) => onDraft({ method })}
          />
          {hasParticles(draft.method, catalogue.optimizers) &&
            field('particles', 'Particles', 'designs of an iteration')}
          {field('iterations', 'Iterations', 'of the search')}
          {field('seed', 'Seed', 'only runs of different seeds show what can be trusted')}
        </div>
      </section>
      <SubmitPanel spec={spec} submission={submission} onJson={() => setAsJson(true)} />
    </form>
  )
}
