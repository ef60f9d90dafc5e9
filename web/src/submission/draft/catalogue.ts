/** Everything that the form offers, as the API lists it. */

import { get } from '../../api/client'
import type {
  Controller,
  OptimizerPreset,
  PluginCase,
  PreferencePreset,
  RobotPreset,
  ScenarioPreset,
  Variable,
} from '../../api/types'
import { fieldsOf, type OpenApiDocument, type SchemaField } from '../fields/schema-fields'

export interface Catalogue {
  readonly controllers: readonly Controller[]
  readonly robots: readonly RobotPreset[]
  readonly scenarios: readonly ScenarioPreset[]
  readonly preferences: readonly PreferencePreset[]
  readonly optimizers: readonly OptimizerPreset[]
  /** Of plug-ins. */
  readonly cases: readonly PluginCase[]
  readonly fields: {
    readonly job: ReadonlyMap<string, SchemaField>
    readonly scenario: ReadonlyMap<string, SchemaField>
    readonly variant: ReadonlyMap<string, SchemaField>
    readonly worlds: ReadonlyMap<string, SchemaField>
    /** Of a calibration. */
    readonly target: ReadonlyMap<string, SchemaField>
  }
}

/** All that a job may search or hold fixed with a controller. */
export function variablesOf(controller: Controller | undefined): readonly Variable[] {
  if (!controller) return []
  return [...controller.variables, ...controller.conventions, ...controller.gait_variables]
}

/** Those of the names that are variables of leg groups, as `stride[front]`. */
export function ofLegGroups(known: readonly Variable[], names: Iterable<string>): Variable[] {
  return [...names].flatMap((name) => {
    const base = /^(\w+)\[[^[\]]+\]$/.exec(name)?.[1]
    const whole = known.find((variable) => variable.name === base && variable.by_leg_group)
    return whole ? [{ ...whole, name }] : []
  })
}

export async function loadCatalogue(signal: AbortSignal): Promise<Catalogue> {
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
