/** The parameters that may be fitted, each with its bounds, to be picked. */

import type { Variable } from '../../api/types'
import { inWords } from '../../format/words'
import type { FieldErrors } from '../draft/build-spec'
import type { VariableDraft, VariableMode } from '../draft/draft'
import { VariableTable } from '../sections/variables-section'
import { allSaid, fittedNames, type Parameters, parameterDrafts } from './parameters'

const MODES: readonly VariableMode[] = ['default', 'searched']

export function ParametersTable({
  parameters,
  errors,
  onSaid,
}: {
  parameters: Parameters
  errors: FieldErrors
  onSaid: (said: Readonly<Record<string, VariableDraft>>) => void
}) {
  const { known, said } = parameters
  const drafts = parameterDrafts(parameters)
  const fitted = fittedNames(parameters).length
  return (
    <details open={known.length > 0}>
      <summary>
        Parameters: {fitted} of {known.length} fitted
      </summary>
      <div class="stack-tight">
        <div class="row">
          <button
            type="button"
            class="compact"
            onClick={() => onSaid(allSaid(parameters, 'searched'))}
          >
            Fit all
          </button>
          <button
            type="button"
            class="compact"
            onClick={() => onSaid(allSaid(parameters, 'default'))}
          >
            Fit none
          </button>
        </div>
        <div class="fit-parameters-list">
          <VariableTable
            title="Fitted"
            variables={known}
            modes={MODES}
            words={wordsOf}
            drafts={drafts}
            errors={errors}
            onChange={(name, changes) =>
              onSaid({ ...said, [name]: { ...drafts[name], ...changes } })
            }
          />
        </div>
      </div>
    </details>
  )
}

function wordsOf(mode: VariableMode, { default: value, choices }: Variable): string {
  if (mode === 'searched') return 'fitted'
  if (value === undefined || value === null) return 'as it is'
  return `as it is: ${inWords(choices?.[value] ?? String(value))}`
}
