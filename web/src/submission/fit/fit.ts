/** What identifications and calibrations share: which variables are fitted, and how. Pure. */

import type { FieldError } from '../../api/problem'
import type { OptimizerPreset } from '../../api/types'
import { number } from '../draft/build-spec'
import type { VariableDraft } from '../draft/draft'
import { fittedVariables, type Parameters } from './parameters'

/** Everything as it was typed; the robot is that of the measured walk. */
export interface FitDraft {
  readonly name: string
  /** What was said of parameters; all others are as usual. */
  readonly said: Readonly<Record<string, VariableDraft>>
  readonly method: string
  readonly particles: string
  readonly iterations: string
  readonly seed: string
}

export const EMPTY_FIT: FitDraft = {
  name: '',
  said: {},
  method: 'pso',
  particles: '48',
  iterations: '120',
  seed: '1',
}

/** The parts of a spec that the draft says. What is no number is sent as typed, to be refused. */
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

/** Whether a method has designs of an iteration to be told. */
export function hasParticles(method: string, methods: readonly OptimizerPreset[]): boolean {
  const found = methods.find(({ settings }) => settings.name === method)
  return found !== undefined && 'particles' in found.settings
}

/** The API's messages by the first part of the field; of a list's entry, which one. */
export function errorsByPart(errors: readonly FieldError[]): Readonly<Record<string, string>> {
  const found: Record<string, string> = {}
  for (const { field, message } of errors) {
    const [first = '', ...rest] = field.split('.')
    const place = rest.map((part) => (/^\d+$/.test(part) ? `entry ${Number(part) + 1}` : part))
    const text = place.length > 0 ? `${place.join(', ')}: ${message}` : message
    found[first] = found[first] === undefined ? text : `${found[first]}; ${text}`
  }
  return found
}

export function words(text: string): string[] {
  return text.split(/[\s,]+/).filter((word) => word !== '')
}

/** Wide at first and narrow at last: there are many parameters, and one valley. */
function methodOf({ method, particles }: FitDraft, methods: readonly OptimizerPreset[]) {
  return {
    name: method,
    ...(hasParticles(method, methods) && { particles: number(particles) }),
    ...(method === 'pso' && { inertia_start: 0.9, inertia_end: 0.4 }),
  }
}
