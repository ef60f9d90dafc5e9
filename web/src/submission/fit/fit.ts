/** Common parts of identification and calibration specs. */

import type { FieldError } from '../../api/problem'
import type { OptimizerPreset } from '../../api/types'
import type { VariableDraft } from '../draft/draft'
import { number } from '../draft/settings'
import { fittedVariables, type Parameters } from './parameters'

export interface FitDraft {
  readonly name: string
  readonly edited: Readonly<Record<string, VariableDraft>>
  readonly method: string
  readonly particles: string
  readonly iterations: string
  readonly seed: string
}

export const EMPTY_FIT: FitDraft = {
  name: '',
  edited: {},
  method: 'pso',
  particles: '48',
  iterations: '120',
  seed: '1',
}

/** Common parts of the spec. Invalid numbers are sent as text, for the API to reject. */
export function fitOf(
  draft: FitDraft,
  parameters: Parameters,
  methods: readonly OptimizerPreset[],
) {
  return {
    name: draft.name,
    variables: fittedVariables(parameters),
    optimizer: methodOf(draft, methods),
    iterations: number(draft.iterations),
    seed: number(draft.seed),
  }
}

export function hasParticles(method: string, methods: readonly OptimizerPreset[]): boolean {
  const entry = methods.find(({ settings }) => settings.name === method)
  return entry !== undefined && 'particles' in entry.settings
}

/** API errors by the first part of the field; entries of lists are numbered. */
export function errorsByPart(errors: readonly FieldError[]): Readonly<Record<string, string>> {
  const byPart: Record<string, string> = {}
  for (const { field, message } of errors) {
    const [first = '', ...rest] = field.split('.')
    const place = rest.map((part) => (/^\d+$/.test(part) ? `entry ${Number(part) + 1}` : part))
    const text = place.length > 0 ? `${place.join(', ')}: ${message}` : message
    byPart[first] = byPart[first] === undefined ? text : `${byPart[first]}; ${text}`
  }
  return byPart
}

export function words(text: string): string[] {
  return text.split(/[\s,]+/).filter((word) => word !== '')
}

// Much exploration at first and little at last: many parameters, one valley.
function methodOf({ method, particles }: FitDraft, methods: readonly OptimizerPreset[]) {
  return {
    name: method,
    ...(hasParticles(method, methods) && { particles: number(particles) }),
    ...(method === 'pso' && { inertia_start: 0.9, inertia_end: 0.4 }),
  }
}
