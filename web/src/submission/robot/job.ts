/** What a robot's own folder says of its jobs: `job.json`, as `gaitswarm robot init` writes it. */

import type { JobSpec } from '../../api/types'
import { specOf } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { type Draft, draftOf } from '../draft/draft'

/**
 * The draft with what the robot says of scenarios, controller, variables and all else; its name and
 * robot stay. Throws with what is wrong with the text.
 */
export function withRobotJob(draft: Draft, catalogue: Catalogue, text: string): Draft {
  return withJob(draft, catalogue, objectIn(text))
}

/** The same of what was read already. Throws where its controller is not known here. */
export function withJob(draft: Draft, catalogue: Catalogue, own: Partial<JobSpec>): Draft {
  const controller = own.controller ?? draft.controller
  if (!catalogue.controllers.some(({ name }) => name === controller)) {
    throw new Error(`job.json names a controller ${String(controller)} that is not known here`)
  }
  // Of another robot, and of another controller.
  const { scenarios: _scenarios, variables: _variables, fixed: _fixed, ...rest } = specOf(draft)
  const { name, robot } = draft
  return { ...draftOf({ ...rest, ...own } as JobSpec, catalogue), name, robot }
}

/** A robot's own files are no hexapod's: its presets go, and come back with a robot that ships. */
export function ofKind(draft: Draft, kind: Draft['robot']['kind'], empty: Draft): Partial<Draft> {
  const robot = { ...draft.robot, kind }
  if ((kind === 'files') === (draft.robot.kind === 'files')) return { robot }
  return { robot, presets: kind === 'files' ? [] : empty.presets }
}

function objectIn(text: string): Partial<JobSpec> {
  let found: unknown
  try {
    found = JSON.parse(text)
  } catch (error) {
    throw new Error(`job.json is no JSON: ${error instanceof Error ? error.message : error}`)
  }
  if (typeof found === 'object' && found !== null && !Array.isArray(found)) return found
  throw new Error('job.json must hold one JSON object')
}
