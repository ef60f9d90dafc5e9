/** Options of the form, as listed by the API. */

import { get } from '../../api/client'
import type { Controller, Variable } from '../../api/types'
import { fieldsOf, type OpenApiDocument } from '../fields/schema-fields'

export type Catalogue = Awaited<ReturnType<typeof loadCatalogue>>

/** All variables that a job can search or fix with a controller. */
export function variablesOf(controller: Controller | undefined): readonly Variable[] {
  if (!controller) return []
  return [...controller.variables, ...controller.conventions, ...controller.gait_variables]
}

/** Variables of leg groups among the names, such as `stride[front]`. */
export function ofLegGroups(variables: readonly Variable[], names: Iterable<string>): Variable[] {
  return [...names].flatMap((name) => {
    const base = /^(\w+)\[[^[\]]+\]$/.exec(name)?.[1]
    const whole = variables.find((variable) => variable.name === base && variable.by_leg_group)
    return whole ? [{ ...whole, name }] : []
  })
}

export async function loadCatalogue(signal: AbortSignal) {
  const [controllers, robots, scenarios, preferences, optimizers, cases, document] =
    await Promise.all([
      get('/v1/controllers', { signal }),
      get('/v1/robots', { signal }),
      get('/v1/scenarios', { signal }),
      get('/v1/preferences', { signal }),
      get('/v1/optimizers', { signal }),
      get('/v1/cases', { signal }),
      fetch('/openapi.json', { signal }).then(
        (answer) => answer.json() as Promise<OpenApiDocument>,
      ),
    ])
  return {
    controllers: controllers.items,
    robots: robots.items,
    scenarios: scenarios.items,
    preferences: preferences.items,
    optimizers: optimizers.items,
    cases: cases.items,
    fields: {
      job: fieldsOf(document, 'JobSpec'),
      scenario: fieldsOf(document, 'Scenario'),
      variant: fieldsOf(document, 'RobotVariant'),
      worlds: fieldsOf(document, 'TuningWorlds'),
      target: fieldsOf(document, 'Target'),
    },
  }
}
