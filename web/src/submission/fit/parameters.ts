/** Parameters to fit, with bounds. */

import type { FieldError } from '../../api/problem'
import type { Variable } from '../../api/types'
import type { FieldErrors } from '../draft/build-spec'
import { type VariableDraft, variableDraft } from '../draft/draft'
import { number } from '../draft/settings'

export interface Parameters {
  readonly fittable: readonly Variable[]
  readonly fittedByDefault: readonly string[] | null
  readonly edited: Readonly<Record<string, VariableDraft>>
}

export function parameterDrafts({
  fittable,
  fittedByDefault,
  edited,
}: Parameters): Record<string, VariableDraft> {
  const mode = (name: string) =>
    fittedByDefault === null || fittedByDefault.includes(name) ? 'searched' : 'default'
  return Object.fromEntries(
    fittable.map((variable) => {
      const { name } = variable
      return [name, edited[name] ?? variableDraft(variable, mode(name))]
    }),
  )
}

export function fittedNames(parameters: Parameters): readonly string[] {
  const drafts = parameterDrafts(parameters)
  return Object.keys(drafts).filter((name) => drafts[name].mode === 'searched')
}

/** Variables for a spec: just names where the bounds are the defaults. */
export function fittedVariables(parameters: Parameters) {
  const drafts = parameterDrafts(parameters)
  return fittedNames(parameters).map((name) => {
    const { low, high, choices } = drafts[name]
    const variable = parameters.fittable.find((entry) => entry.name === name)!
    const defaults = variableDraft(variable, 'searched')
    if (choices.length > 0) {
      return choices.length === defaults.choices.length
        ? name
        : { name, kind: 'categorical', choices }
    }
    return low === defaults.low && high === defaults.high
      ? name
      : { name, low: number(low), high: number(high) }
  })
}

export function allEdited(
  { fittable }: Parameters,
  mode: 'searched' | 'default',
): Record<string, VariableDraft> {
  return Object.fromEntries(fittable.map((v) => [v.name, variableDraft(v, mode)]))
}

export function parameterErrors(
  errors: readonly FieldError[],
  parameters: Parameters,
): FieldErrors {
  const names = fittedNames(parameters)
  return new Map(
    errors.flatMap(({ field, message }) => {
      const [, index, ...rest] = /^variables\.(\d+)(?:\.(.*))?$/.exec(field) ?? []
      const name = names[Number(index ?? Number.NaN)]
      return name === undefined
        ? []
        : [[['variables', name, ...rest.filter((part) => part)].join('.'), message] as const]
    }),
  )
}
