/** Everything that the form offers, as the API lists it. */

import { get } from '../api/client'
<<<<<<< HEAD
import type { Controller, OptimizerPreset, PreferencePreset, ScenarioPreset } from '../api/types'
=======
import type { Controller, PreferencePreset, RobotPreset, ScenarioPreset } from '../api/types'
>>>>>>> f566b53 (List the robots that ship over HTTP, and offer them on the page)
import { fieldsOf, type OpenApiDocument, type SchemaField } from './schema-fields'

export interface Catalogue {
  readonly controllers: readonly Controller[]
  readonly robots: readonly RobotPreset[]
  readonly scenarios: readonly ScenarioPreset[]
  readonly preferences: readonly PreferencePreset[]
  readonly optimizers: readonly OptimizerPreset[]
  readonly fields: {
    readonly job: ReadonlyMap<string, SchemaField>
    readonly scenario: ReadonlyMap<string, SchemaField>
    readonly optimizer: ReadonlyMap<string, SchemaField>
    readonly variant: ReadonlyMap<string, SchemaField>
  }
}

export async function loadCatalogue(signal: AbortSignal): Promise<Catalogue> {
<<<<<<< HEAD
  const [controllers, scenarios, preferences, optimizers, document] = await Promise.all([
=======
  const [controllers, robots, scenarios, preferences, document] = await Promise.all([
>>>>>>> f566b53 (List the robots that ship over HTTP, and offer them on the page)
    get('/v1/controllers', { signal }),
    get('/v1/robots', { signal }),
    get('/v1/scenarios', { signal }),
    get('/v1/preferences', { signal }),
    get('/v1/optimizers', { signal }),
    fetch('/openapi.json', { signal }).then((answer) => answer.json() as Promise<OpenApiDocument>),
  ])
  return {
    controllers: controllers.items,
    robots: robots.items,
    scenarios: scenarios.items,
    preferences: preferences.items,
    optimizers: optimizers.items,
    fields: {
      job: fieldsOf(document, 'JobSpec'),
      scenario: fieldsOf(document, 'Scenario'),
      optimizer: fieldsOf(document, 'PsoSettings'),
      variant: fieldsOf(document, 'RobotVariant'),
    },
  }
}
