/** Controller, and treatment of its variables and of the gait's. */

import { useState } from 'preact/hooks'
import type { Variable } from '../../api/types'
import { Card } from '../../components/card'
import { Check, Select } from '../../components/fields/controls'
import { ChoiceField, Problems } from '../../components/fields/field'
import { type Column, Table } from '../../components/table/table'
import { NONE } from '../../format/number'
import { inWords } from '../../format/words'
import { errorsUnder, type FieldErrors } from '../draft/build-spec'
import { ofLegGroups } from '../draft/catalogue'
import { type VariableDraft, type VariableMode, variableDraft, withSearch } from '../draft/draft'
import type { SectionProps } from './settings'

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
    <Card title="Controller and variables">
      <div class="stack">
        <div class="controller-choice">
          <ChoiceField
            label="Controller"
            choices={catalogue.controllers.map(({ name }) => name)}
            value={draft.controller}
            error={errors.get('controller')}
            hint={controller?.description}
            onChange={(name) => onChange(withSearch(draft, catalogue, { controller: name }))}
          />
        </div>
        <Problems messages={[errors.get('variables'), errors.get('fixed')]} />
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
    </Card>
  )
}

interface AddGroupProps {
  variables: readonly Variable[]
  onAdd: (variable: Variable) => void
}

/** Adds a gait variable for a group of legs: `stride[front]`. */
function AddGroup({ variables, onAdd }: AddGroupProps) {
  const [name, setName] = useState(variables[0]?.name ?? '')
  const [group, setGroup] = useState('front')
  const [added] = ofLegGroups(variables, [`${name}[${group.trim()}]`])
  return (
    <div class="row">
      <Select
        label="Add"
        value={name}
        options={variables.map((variable) => [variable.name, inWords(variable.name)] as const)}
        onChoose={setName}
      />
      <label class="row small">
        <span>for legs</span>
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
  const problemsOf = (name: string) => errorsUnder(errors, `variables.${name}`)
  const input = ({ name }: Variable, part: 'low' | 'high' | 'value', label: string) => (
    <input
      class="short"
      inputMode="decimal"
      aria-label={`${label} of ${name}`}
      aria-invalid={problemsOf(name).length > 0}
      value={drafts[name][part]}
      onInput={(event) => onChange(name, { [part]: event.currentTarget.value })}
    />
  )
  const columns: readonly Column<Variable>[] = [
    {
      key: 'variable',
      header: true,
      cell: ({ name, description }) => (
        <>
          {name}
          <span class="muted small description">{description}</span>
          {problemsOf(name).map((problem) => (
            <span key={problem} class="wrong description">
              {problem}
            </span>
          ))}
        </>
      ),
    },
    {
      key: 'treatment',
      cell: (variable) => (
        <Select
          hidden
          label={`Treatment of ${variable.name}`}
          value={drafts[variable.name].mode}
          options={modes.map((mode) => [mode, words(mode, variable)] as const)}
          onChoose={(mode) => onChange(variable.name, { mode })}
        />
      ),
    },
    {
      key: 'low or value',
      cell: (variable) => {
        const { name, kind, choices = [] } = variable
        const { mode, value, choices: searched } = drafts[name]
        if (mode === 'default') return null
        if (kind !== 'categorical') {
          return mode === 'searched'
            ? input(variable, 'low', 'Lower bound')
            : input(variable, 'value', 'Value')
        }
        if (mode === 'fixed') {
          return (
            <Select
              hidden
              label={`Value of ${name}`}
              value={value}
              options={(choices ?? []).map((choice) => [choice, inWords(choice)] as const)}
              onChoose={(choice) => onChange(name, { value: choice })}
            />
          )
        }
        return (
          <fieldset class="row" aria-label={`Choices of ${name}`}>
            {(choices ?? []).map((choice) => (
              <span key={choice} class="nowrap">
                <Check
                  small={false}
                  label={inWords(choice)}
                  checked={searched.includes(choice)}
                  onChange={() =>
                    onChange(name, {
                      // In the variable's order.
                      choices: (choices ?? []).filter(
                        (each) => searched.includes(each) !== (each === choice),
                      ),
                    })
                  }
                />
              </span>
            ))}
          </fieldset>
        )
      },
    },
    {
      key: 'high',
      cell: (variable) =>
        drafts[variable.name].mode === 'searched' &&
        variable.kind !== 'categorical' &&
        input(variable, 'high', 'Upper bound'),
    },
    {
      key: 'unit',
      cell: ({ unit, kind }) => (
        <span class="unit">
          {unit === '1' ? NONE : unit}
          {kind === 'integer' && ' (integer)'}
        </span>
      ),
    },
  ]
  return (
    <div class="variables">
      <Table
        caption={`${title} variables`}
        rows={variables.filter(({ name }) => name in drafts)}
        rowKey={({ name }) => name}
        rowData={({ name }) => ({ 'data-variable': name })}
        columns={columns}
        pageSize={Number.POSITIVE_INFINITY}
      />
    </div>
  )
}
