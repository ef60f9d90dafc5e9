/** Table of the parameters to select for fitting, with bounds. */

import type { Variable } from '../../api/types'
import { inWords } from '../../format/words'
import type { FieldErrors } from '../draft/build-spec'
import type { VariableDraft, VariableMode } from '../draft/draft'
import { VariableTable } from '../sections/variables-section'
import { allEdited, fittedNames, type Parameters, parameterDrafts } from './parameters'

const MODES: readonly VariableMode[] = ['default', 'searched']

export function ParametersTable({
  parameters,
  errors,
  onEdit,
}: {
  parameters: Parameters
  errors: FieldErrors
  onEdit: (edited: Readonly<Record<string, VariableDraft>>) => void
}) {
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
