/** Form of a fit: parameters, method, estimate and submission. */

import type { ComponentChildren } from 'preact'
import { useState } from 'preact/hooks'
import { ApiProblem } from '../../api/problem'
import type { AnySpec, Variable } from '../../api/types'
import { Card } from '../../components/card'
import { ChoiceField, Problems, TextField } from '../../components/fields/field'
import { inWords } from '../../format/words'
import type { FieldErrors } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import type { VariableDraft, VariableMode } from '../draft/draft'
import { JsonForm } from '../json-form'
import { VariableTable } from '../sections/variables-section'
import { SubmitPanel } from '../submit-panel'
import { useSubmission } from '../use-submission'
import { errorsByPart, type FitDraft, hasParticles } from './fit'
import {
  allEdited,
  fittedNames,
  type Parameters,
  parameterDrafts,
  parameterErrors,
} from './parameters'

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
  before?: ComponentChildren
  children?: (errors: Readonly<Record<string, string>>) => ComponentChildren
}) {
  const [asJson, setAsJson] = useState(false)
  const submission = useSubmission(spec)
  const { problem } = submission
  const fieldErrors = problem instanceof ApiProblem ? problem.errors : []
  const errors = errorsByPart(fieldErrors)
  const byParameter = parameterErrors(fieldErrors, parameters)
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
      <Card class="stack" title={title}>
        <Problems messages={parts.map((part) => errors[part])} />
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
        {/* Errors that concern all parameters, or one missing in the table. */}
        <Problems messages={byParameter.size === 0 ? [errors.variables] : []} />
        <ParametersTable
          parameters={parameters}
          errors={byParameter}
          onEdit={(edited) => onDraft({ edited })}
        />
      </Card>
      <SubmitPanel spec={spec} submission={submission} onJson={() => setAsJson(true)} />
    </form>
  )
}

const MODES: readonly VariableMode[] = ['default', 'searched']

interface ParametersTableProps {
  parameters: Parameters
  errors: FieldErrors
  onEdit: (edited: Readonly<Record<string, VariableDraft>>) => void
}

function ParametersTable({ parameters, errors, onEdit }: ParametersTableProps) {
  const { fittable, edited } = parameters
  const drafts = parameterDrafts(parameters)
  const fitted = fittedNames(parameters).length
  return (
    <details open={fittable.length > 0}>
      <summary>
        Parameters: {fitted} of {fittable.length} fitted
      </summary>
      <div class="stack-tight">
        <div class="row">
          <button
            type="button"
            class="compact"
            onClick={() => onEdit(allEdited(parameters, 'searched'))}
          >
            Fit all
          </button>
          <button
            type="button"
            class="compact"
            onClick={() => onEdit(allEdited(parameters, 'default'))}
          >
            Fit none
          </button>
        </div>
        <div class="fit-parameters-list">
          <VariableTable
            title="Fitted"
            variables={fittable}
            modes={MODES}
            words={wordsOf}
            drafts={drafts}
            errors={errors}
            onChange={(name, changes) =>
              onEdit({ ...edited, [name]: { ...drafts[name], ...changes } })
            }
          />
        </div>
      </div>
    </details>
  )
}

function wordsOf(mode: VariableMode, { default: value, choices }: Variable): string {
  if (mode === 'searched') return 'fitted'
  if (value === undefined || value === null) return 'unchanged'
  return `unchanged: ${inWords(choices?.[value] ?? String(value))}`
}
