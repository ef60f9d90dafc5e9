/** Upload of a measured log: form state, request and errors. */

import type { FieldError } from '../../../api/problem'
import type { MeasuredWalkRequest, RobotSource } from '../../../api/types'
import type { Catalogue } from '../../draft/catalogue'

export interface WalkDraft {
  readonly scenario: string
  /** Empty for the preset's value. */
  readonly cycles: string
  readonly controller: string
  readonly design: string
}

export type WalkField = 'log' | 'robot' | keyof WalkDraft

export function emptyWalk({ scenarios, controllers }: Catalogue): WalkDraft {
  const [controller] = controllers
  const [study = ''] = Object.keys(controller.published)
  return {
    scenario: scenarios[0].name,
    cycles: '',
    controller: controller.name,
    design: publishedDesign(controller, study),
  }
}

export function publishedDesign({ published }: Catalogue['controllers'][number], study: string) {
  return JSON.stringify(published[study] ?? {}, null, 1)
}

/** Build the request; invalid JSON and numbers are sent as text, for the API to reject. */
export function measuredRequest(
  draft: WalkDraft,
  robot: RobotSource,
  log: string,
  catalogue: Catalogue,
): MeasuredWalkRequest {
  return {
    robot,
    scenario: scenarioOf(draft, catalogue),
    controller: draft.controller,
    design: json(draft.design),
    log,
  } as MeasuredWalkRequest
}

export function walkErrors(errors: readonly FieldError[]): Partial<Record<WalkField | '', string>> {
  const byField: Partial<Record<WalkField | '', string>> = {}
  for (const { field, message } of errors) {
    const [first, ...rest] = field.split('.')
    const name = FIELDS.find((entry) => entry === first) ?? ''
    const shown = rest.at(-1) === 'cycles' ? 'cycles' : name
    const inside = shown === name && rest.length > 0 ? `${rest.join('.')}: ` : ''
    byField[shown] =
      `${byField[shown] === undefined ? '' : `${byField[shown]}; `}${inside}${message}`
  }
  return byField
}

const FIELDS: readonly WalkField[] = ['log', 'robot', 'scenario', 'controller', 'design']

/** Name of the preset, or all its fields with the given cycles. */
function scenarioOf({ scenario, cycles }: WalkDraft, { scenarios, fields }: Catalogue): unknown {
  const preset = scenarios.find(({ name }) => name === scenario)
  const text = cycles.trim()
  if (text === '' || !preset) return scenario
  const presetValues = [...fields.scenario.keys()].map((name) => [
    name,
    preset[name as keyof typeof preset],
  ])
  const number = Number(text)
  return { ...Object.fromEntries(presetValues), cycles: Number.isNaN(number) ? text : number }
}

function json(text: string): unknown {
  try {
    return JSON.parse(text)
  } catch {
    return text
  }
}
