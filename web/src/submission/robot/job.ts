/** Job settings of a robot folder: `job.json`, as written by `gaitswarm robot init`. */

import type { JobSpec } from '../../api/types'
import { specOf } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { type Draft, draftOf } from '../draft/draft'

/** Apply a job.json to the draft, except name and robot. Throws a message for the user. */
export function withRobotJob(draft: Draft, catalogue: Catalogue, text: string): Draft {
  return withJob(draft, catalogue, objectIn(text))
}

/** Apply parsed settings. Throws if the controller is unknown. */
export function withJob(draft: Draft, catalogue: Catalogue, settings: Partial<JobSpec>): Draft {
  const controller = settings.controller ?? draft.controller
  if (!catalogue.controllers.some(({ name }) => name === controller)) {
    throw new Error(`job.json names the unknown controller ${String(controller)}`)
  }
  // Settings of the previous robot and controller do not apply.
  const { scenarios: _scenarios, variables: _variables, fixed: _fixed, ...rest } = specOf(draft)
  const { name, robot } = draft
  return { ...draftOf({ ...rest, ...settings } as JobSpec, catalogue), name, robot }
}

/** Change the kind of robot; presets do not apply to custom robots. */
export function ofKind(draft: Draft, kind: Draft['robot']['kind'], empty: Draft): Partial<Draft> {
  const robot = { ...draft.robot, kind }
  if ((kind === 'files') === (draft.robot.kind === 'files')) return { robot }
  return { robot, presets: kind === 'files' ? [] : empty.presets }
}

function objectIn(text: string): Partial<JobSpec> {
  let value: unknown
  try {
    value = JSON.parse(text)
  } catch (error) {
    throw new Error(`job.json is not valid JSON: ${error instanceof Error ? error.message : error}`)
  }
  if (typeof value === 'object' && value !== null && !Array.isArray(value)) return value
  throw new Error('job.json must hold one JSON object')
}
