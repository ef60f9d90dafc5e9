/** Controller, and treatment of its variables and of the gait's. */

import { useState } from 'preact/hooks'
import type { Variable } from '../../api/types'
import { inWords } from '../../format/words'
import { errorsUnder, type FieldErrors } from '../draft/build-spec'
import { ofLegGroups } from '../draft/catalogue'
import {
  defaultVariables,
  type VariableDraft,
  type VariableMode,
  variableDraft,
} from '../draft/draft'
import { ChoiceField, Problems } from '../fields/number-field'
import type { SectionProps } from './section'

export function VariablesSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const controller = catalogue.controllers.find(({ name }) => name === draft.controller)
  const change = (name: string, changes: Partial<VariableDraft>) =>
    onChange({
      variables: { ...draft.variables, [name]: { ...draft.variables[name], ...changes } },
    })
  const gait = controller?.gait_variables ?? []
  const groups = ofLegGroups(gait, Object.keys(draft.variables))
  const table = (title: string, variables: readonly Variable[], modes: readonly VariableMode[]) => (
    <VariableTable
      title={title}
      variables={variables}
      modes={modes}
      drafts={draft.variables}
      errors={errors}
      onChange={change}
    />
  )
  return (
    <section class="card" aria-labelledby="part-controller">
      <h2 id="part-controller">Controller and variables</h2>
      <div class="stack">
        <div class="controller-choice">
          <ChoiceField
            label="Controller"
            choices={catalogue.controllers.map(({ name }) => name)}
            value={draft.controller}
            error={errors.get('controller')}
            hint={controller?.description}
            onChange={(name) =>
              onChange({ controller: name, variables: defaultVariables(catalogue, name) })
            }
          />
        </div>
        <Problems
          messages={[errors.get('variables'), errors.get('fixed')].filter((m) => m !== undefined)}
        />
        {controller && (
          <>
            {table('Controller', controller.variables, ['searched', 'fixed'])}
            {controller.conventions.length > 0 && (
              <details open={anySet(controller.conventions, draft.variables)}>
                <summary>Conventions: choices that the thesis leaves open</summary>
                {table('Convention', controller.conventions, ['default', 'searched', 'fixed'])}
              </details>
            )}
            <details open={anySet([...gait, ...groups], draft.variables)}>
              <summary>Gait: overrides of the scenarios’ gait parameters</summary>
              {table('Gait', [...gait, ...groups], ['default', 'searched', 'fixed'])}
              <AddGroup
                variables={gait.filter((variable) => variable.by_leg_group)}
                onAdd={(variable) =>
                  onChange({
                    variables: {
                      ...draft.variables,
                      [variable.name]: variableDraft(variable, 'searched'),
                    },
                  })
                }
              />
            </details>
          </>
        )}
      </div>
    </section>
  )
}

/** Adds a gait variable for a group of legs: `stride[front]`. */
function AddGroup({
  variables,
  onAdd,
}: {
  variables: readonly Variable[]
  onAdd: (variable: Variable) => void
}) {
  const [name, setName] = useState(variables[0]?.name ?? '')
  const [group, setGroup] = useState('front')
  const [added] = ofLegGroups(variables, [`${name}[${group.trim()}]`])
  return (
    <div class="row">
      <label class="row">
        <span class="label">Add</span>
        <select value={name} onChange={(event) => setName(event.currentTarget.value)}>
          {variables.map((variable) => (
            <option key={variable.name} value={variable.name}>
              {inWords(variable.name)}
            </option>
          ))}
        </select>
      </label>
      <label class="row">
        <span class="label">for legs</span>
        <input
          class="short"
          value={group}
          title="front, middle, hind, left, right, a leg’s name, or a group defined by the robot"
          onInput={(event) => setGroup(event.currentTarget.value)}
        />
      </label>
      <button type="button" class="compact" disabled={!added} onClick={() => added && onAdd(added)}>
        Add
      </button>
    </div>
  )
}

function anySet(
  variables: readonly Variable[],
  drafts: Readonly<Record<string, VariableDraft>>,
): boolean {
  return variables.some(({ name }) => drafts[name]?.mode !== 'default')
}

/** The default of a convention is a value; that of a gait variable depends on the scenario. */
function modeInWords(mode: VariableMode, { default: value, choices }: Variable): string {
  if (mode !== 'default') return mode
  if (value === undefined || value === null) return 'as in scenario'
  return `default: ${inWords(choices?.[value] ?? String(value))}`
}

/** words: labels of the treatments. */
export function VariableTable({
  title,
  variables,
  modes,
  words = modeInWords,
  drafts,
  errors,
  onChange,
}: {
  title: string
  variables: readonly Variable[]
  modes: readonly VariableMode[]
  words?: (mode: VariableMode, variable: Variable) => string
  drafts: Readonly<Record<string, VariableDraft>>
  errors: FieldErrors
  onChange: (name: string, changes: Partial<VariableDraft>) => void
}) {
  return (
    <div class="table-scroll">
      <table class="variables">
        <caption class="visually-hidden">{title} variables</caption>
        <thead>
          <tr>
            <th scope="col">Variable</th>
            <th scope="col">Treatment</th>
            <th scope="col">Low or value</th>
            <th scope="col">High</th>
            <th scope="col">Unit</th>
          </tr>
        </thead>
        <tbody>
          {variables.map((variable) => {
            const draft = drafts[variable.name]
            if (!draft) return null
            const change = (changes: Partial<VariableDraft>) => onChange(variable.name, changes)
            return (
              <VariableRow
                key={variable.name}
                variable={variable}
                draft={draft}
                modes={modes}
                words={words}
                problems={errorsUnder(errors, `variables.${variable.name}`)}
                onChange={change}
              />
            )
          })}
        </tbody>
      </table>
    </div>
  )
}

function VariableRow({
  variable,
  draft,
  modes,
  words,
  problems,
  onChange,
}: {
  variable: Variable
  draft: VariableDraft
  modes: readonly VariableMode[]
  words: (mode: VariableMode, variable: Variable) => string
  problems: readonly string[]
  onChange: (changes: Partial<VariableDraft>) => void
}) {
  const { name, choices = [] } = variable
  const categorical = variable.kind === 'categorical'
  const input = (part: 'low' | 'high' | 'value', label: string) => (
    <input
      class="short"
      inputMode="decimal"
      aria-label={`${label} of ${name}`}
      aria-invalid={problems.length > 0}
      value={draft[part]}
      onInput={(event) => onChange({ [part]: event.currentTarget.value })}
    />
  )
  return (
    <tr data-variable={name}>
      <th scope="row">
        {name}
        <span class="muted small description">{variable.description}</span>
        {problems.map((problem) => (
          <span key={problem} class="wrong description">
            {problem}
          </span>
        ))}
      </th>
      <td>
        <select
          aria-label={`Treatment of ${name}`}
          value={draft.mode}
          onChange={(event) => onChange({ mode: event.currentTarget.value as VariableMode })}
        >
          {modes.map((mode) => (
            <option key={mode} value={mode}>
              {words(mode, variable)}
            </option>
          ))}
        </select>
      </td>
      <td>
        {draft.mode === 'searched' && categorical && (
          <Choices variable={variable} chosen={draft.choices} onChange={onChange} />
        )}
        {draft.mode === 'searched' && !categorical && input('low', 'Lower bound')}
        {draft.mode === 'fixed' && categorical && (
          <select
            aria-label={`Value of ${name}`}
            value={draft.value}
            onChange={(event) => onChange({ value: event.currentTarget.value })}
          >
            {choices.map((choice) => (
              <option key={choice} value={choice}>
                {inWords(choice)}
              </option>
            ))}
          </select>
        )}
        {draft.mode === 'fixed' && !categorical && input('value', 'Value')}
      </td>
      <td>{draft.mode === 'searched' && !categorical && input('high', 'Upper bound')}</td>
      <td class="unit">
        {variable.unit === '1' ? '–' : variable.unit}
        {variable.kind === 'integer' && ' (integer)'}
      </td>
    </tr>
  )
}

/** Searched choices of a categorical variable. */
function Choices({
  variable: { name, choices = [] },
  chosen,
  onChange,
}: {
  variable: Variable
  chosen: readonly string[]
  onChange: (changes: Partial<VariableDraft>) => void
}) {
  const toggle = (choice: string) =>
    onChange({
      // In the variable's order.
      choices: choices.filter((c) => chosen.includes(c) !== (c === choice)),
    })
  return (
    <fieldset class="row" aria-label={`Choices of ${name}`}>
      {choices.map((choice) => (
        <label key={choice} class="check nowrap">
          <input
            type="checkbox"
            checked={chosen.includes(choice)}
            onChange={() => toggle(choice)}
          />
          {inWords(choice)}
        </label>
      ))}
    </fieldset>
  )
}
