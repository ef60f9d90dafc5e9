/** Which parameters a job fits, and within which bounds. Pure. */

import type { FieldError } from '../../api/problem'
import type { Variable } from '../../api/types'
import { type FieldErrors, number } from '../draft/build-spec'
import { type VariableDraft, variableDraft } from '../draft/draft'

export interface Parameters {
  /** All that may be fitted. */
  readonly known: readonly Variable[]
  /** Names of those that are fitted unless something else is said; null for all. */
  readonly usual: readonly string[] | null
  /** What was said of some. */
  readonly said: Readonly<Record<string, VariableDraft>>
}

/** Every parameter as the form shows it. */
export function parameterDrafts({ known, usual, said }: Parameters): Record<string, VariableDraft> {
  const mode = (name: string) => (usual === null || usual.includes(name) ? 'searched' : 'default')
  return Object.fromEntries(
    known.map((variable) => {
      const { name } = variable
      return [name, said[name] ?? variableDraft(variable, mode(name))]
    }),
  )
}

/** Those that are fitted, in the order of the form. */
export function fittedNames(parameters: Parameters): readonly string[] {
  const drafts = parameterDrafts(parameters)
  return Object.keys(drafts).filter((name) => drafts[name].mode === 'searched')
}

/** What a spec says of them: names where the bounds are the usual ones. */
export function fittedVariables(parameters: Parameters) {
  const drafts = parameterDrafts(parameters)
  return fittedNames(parameters).map((name) => {
    const { low, high, choices } = drafts[name]
    const variable = parameters.known.find((known) => known.name === name)!
    const usual = variableDraft(variable, 'searched')
    if (choices.length > 0) {
      return choices.length === usual.choices.length ? name : { name, kind: 'categorical', choices }
    }
    return low === usual.low && high === usual.high
      ? name
      : { name, low: number(low), high: number(high) }
  })
}

/** All of the parameters fitted, or none. */
export function allSaid(
  { known }: Parameters,
  mode: 'searched' | 'default',
): Record<string, VariableDraft> {
  return Object.fromEntries(known.map((v) => [v.name, variableDraft(v, mode)]))
}

/** The API's messages by the parameter that they are of. */
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
