/** What identifications and calibrations share: which variables are fitted, and how. Pure. */

import type { FieldError } from '../../api/problem'
import type { OptimizerPreset } from '../../api/types'

/** Everything as it was typed; the robot is that of the measured walk. */
export interface FitDraft {
  readonly name: string
  readonly variables: string
  readonly method: string
  readonly particles: string
  readonly iterations: string
  readonly seed: string
}

export const EMPTY_FIT: FitDraft = {
  name: '',
  variables: '',
  method: 'pso',
  particles: '48',
  iterations: '120',
  seed: '1',
}

/** The parts of a spec that the draft says. What is no number is sent as typed, to be refused. */
export function fitOf(draft: FitDraft, methods: readonly OptimizerPreset[]) {
  const variables = words(draft.variables).map(variableOf)
  return {
    name: draft.name,
    ...(variables.length > 0 && { variables }),
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

/** The text itself where it is no number. */
export function number(text: string): number | string {
  const value = Number(text)
  return text.trim() === '' || Number.isNaN(value) ? text : value
}

/** `body_mass`, `body_mass=3:5` with bounds, `contact_law=stick:dead_zone` with some choices. */
function variableOf(word: string) {
  const [, name, range] = /^([^=]+)=(.+)$/.exec(word) ?? []
  if (name === undefined) return word
  const parts = range.split(':')
  const [low, high, ...more] = parts.map(number)
  if (typeof low === 'number' && typeof high === 'number' && more.length === 0) {
    return { name, low, high }
  }
  return { name, kind: 'categorical', choices: parts }
}

/** Wide at first and narrow at last: there are many parameters, and one valley. */
function methodOf({ method, particles }: FitDraft, methods: readonly OptimizerPreset[]) {
  return {
    name: method,
    ...(hasParticles(method, methods) && { particles: number(particles) }),
    ...(method === 'pso' && { inertia_start: 0.9, inertia_end: 0.4 }),
  }
}
