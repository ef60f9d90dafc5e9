/** Form of a fit: parameters, method, estimate and submission. */

import type { ComponentChildren } from 'preact'
import { useState } from 'preact/hooks'
import { ApiProblem } from '../../api/problem'
import type { AnySpec } from '../../api/types'
import type { Catalogue } from '../draft/catalogue'
import { ChoiceField, Problems } from '../fields/number-field'
import { TextField } from '../fields/text-field'
import { useFirstProblem } from '../first-problem'
import { JsonForm } from '../json-form'
import { SubmitPanel } from '../submit-panel'
import { useSubmission } from '../use-submission'
import { errorsByPart, type FitDraft, hasParticles } from './fit'
import { type Parameters, parameterErrors } from './parameters'
import { ParametersTable } from './parameters-table'

export function FitForm({
  title,
  catalogue,
  parameters,
  draft,
  onDraft,
  spec,
  parts,
  before,
  children,
}: {
  title: string
  catalogue: Catalogue
  parameters: Parameters
  draft: FitDraft
  onDraft: (changes: Partial<FitDraft>) => void
  spec: AnySpec
  /** Parts of the spec without fields here; their errors are shown together. */
  parts: readonly string[]
  /** Content before the fields. */
  before?: ComponentChildren
  /** Additional fields, given the errors by part. */
  children?: (errors: Readonly<Record<string, string>>) => ComponentChildren
}) {
  const [asJson, setAsJson] = useState(false)
  const submission = useSubmission(spec)
  const { problem } = submission
  const fieldErrors = problem instanceof ApiProblem ? problem.errors : []
  const errors = errorsByPart(fieldErrors)
  const byParameter = parameterErrors(fieldErrors, parameters)
  // Errors that concern all parameters, or one missing in the table.
  const unassigned = byParameter.size === 0 && errors.variables ? [errors.variables] : []
  useFirstProblem(submission.attempts)
  if (asJson) return <JsonForm spec={spec} onBack={() => setAsJson(false)} />
  const field = (
    name: Exclude<keyof FitDraft, 'method' | 'edited'>,
    label: string,
    hint: string,
  ) => (
    <TextField
      label={label}
      value={draft[name]}
      hint={hint}
      error={errors[name]}
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
          {children?.(errors)}
          <ChoiceField
            label="Method"
            choices={catalogue.optimizers.map(({ settings }) => settings.name)}
            value={draft.method}
            error={errors.optimizer}
            onChange={(method) => onDraft({ method })}
          />
          {hasParticles(draft.method, catalogue.optimizers) &&
            field('particles', 'Particles', 'designs per iteration')}
          {field('iterations', 'Iterations', 'of the search')}
          {field('seed', 'Seed', 'runs with different seeds show which parameters can be trusted')}
        </div>
        <Problems messages={unassigned} />
        <ParametersTable
          parameters={parameters}
          errors={byParameter}
          onEdit={(edited) => onDraft({ edited })}
        />
      </section>
      <SubmitPanel spec={spec} submission={submission} onJson={() => setAsJson(true)} />
    </form>
  )
}
