/** The walk that a measured log is of, as it was typed, and the request that it becomes. */

import type { FieldError } from '../../../api/problem'
import type { MeasuredWalkRequest, RobotSource } from '../../../api/types'
import type { Catalogue } from '../../draft/catalogue'

/** Everything as it was typed. */
export interface WalkDraft {
  readonly scenario: string
  /** Empty for those of the preset. */
  readonly cycles: string
  readonly controller: string
  /** JSON. */
  readonly design: string
}

/** Where a problem is shown. */
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

/** A design of the literature as JSON; empty braces if there is none of that name. */
export function publishedDesign({ published }: Catalogue['controllers'][number], study: string) {
  return JSON.stringify(published[study] ?? {}, null, 1)
}

/** What is no JSON object is sent as typed, and so is a number of cycles: the API refuses it. */
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

/** The API's messages by the field of the form; the empty name has those of no field. */
export function walkErrors(errors: readonly FieldError[]): Partial<Record<WalkField | '', string>> {
  const found: Partial<Record<WalkField | '', string>> = {}
  for (const { field, message } of errors) {
    const [first, ...rest] = field.split('.')
    const name = FIELDS.find((known) => known === first) ?? ''
    const shown = rest.at(-1) === 'cycles' ? 'cycles' : name
    const inside = shown === name && rest.length > 0 ? `${rest.join('.')}: ` : ''
    found[shown] = `${found[shown] === undefined ? '' : `${found[shown]}; `}${inside}${message}`
  }
  return found
}

const FIELDS: readonly WalkField[] = ['log', 'robot', 'scenario', 'controller', 'design']

/** The preset's name, or all of it with other cycles. */
function scenarioOf({ scenario, cycles }: WalkDraft, { scenarios, fields }: Catalogue): unknown {
  const preset = scenarios.find(({ name }) => name === scenario)
  const text = cycles.trim()
  if (text === '' || !preset) return scenario
  const own = [...fields.scenario.keys()].map((name) => [name, preset[name as keyof typeof preset]])
  const number = Number(text)
  return { ...Object.fromEntries(own), cycles: Number.isNaN(number) ? text : number }
}

function json(text: string): unknown {
  try {
    return JSON.parse(text)
  } catch {
    return text
  }
}
