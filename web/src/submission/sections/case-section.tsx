/** Evaluation of designs: gaitswarm's simulator, or a plug-in case with its settings. */

import { capitalized, inWords, sentence } from '../../format/words'
import { caseDraft, caseFields } from '../draft/case'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import { describe } from '../fields/schema-fields'
import type { SectionProps } from './section'

const BUILT_IN = 'gaitswarm'

export function CaseSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { cases } = catalogue
  if (cases.length === 0) return null
  const chosen = cases.find(({ name }) => name === draft.case?.name)
  const fields = caseFields(chosen)
  const knownKeys = new Set(fields.map(({ name }) => `case.${name}`))
  const others = [...errors]
    .filter(([key]) => key === 'case' || (key.startsWith('case.') && !knownKeys.has(key)))
    .map(([, message]) => message)
  const needs = chosen?.needs ? ` Not installed where the job would run: ${chosen.needs}.` : ''
  return (
    <section class="card" aria-labelledby="part-case">
      <h2 id="part-case">Case</h2>
      <ChoiceField
        label="Evaluated by"
        choices={[BUILT_IN, ...cases.map(({ name }) => name)]}
        value={draft.case?.name ?? BUILT_IN}
        hint={chosen ? sentence(chosen.description) + needs : 'gaitswarm’s simulator.'}
        onChange={(name) =>
          onChange({ case: caseDraft(cases.find((entry) => entry.name === name)) })
        }
      />
      <Problems messages={others} />
      <div class="fields">
        {fields.map((field) => {
          const shared = {
            label: capitalized(inWords(field.name)),
            value: draft.case?.[field.name] ?? '',
            error: errors.get(`case.${field.name}`),
            onChange: (value: string) => onChange({ case: { ...draft.case, [field.name]: value } }),
          }
          const choices = field.type === 'boolean' ? ['true', 'false'] : field.choices
          return choices ? (
            <ChoiceField key={field.name} {...shared} choices={choices} hint={describe(field)} />
          ) : (
            <NumberField key={field.name} {...shared} field={field} help={describe(field)} />
          )
        })}
      </div>
    </section>
  )
}
