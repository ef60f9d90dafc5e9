/** Files of a custom robot, and the settings in its `job.json`, as written by `gaitswarm robot init`. */

import type { JobSpec, Variable } from '../../api/types'
import type { Design } from '../../format/value'
import { specOf } from '../draft/build-spec'
import type { Catalogue } from '../draft/catalogue'
import { type Draft, draftOf, emptyDraft, middle, withSearch } from '../draft/draft'

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

/** Change the kind of robot; presets and published designs do not apply to custom robots. */
export function ofKind(
  draft: Draft,
  kind: Draft['robot']['kind'],
  catalogue: Catalogue,
): Partial<Draft> {
  const robot = { ...draft.robot, kind }
  if ((kind === 'files') === (draft.robot.kind === 'files')) return { robot }
  const presets = kind === 'files' ? [] : emptyDraft(catalogue).presets
  return { ...withSearch(draft, catalogue, { robot }), presets }
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

/** Texts as the options of `gaitswarm robot init` have them, entries separated by spaces. */
export type Hints = Readonly<Record<'locks' | 'feet' | 'mass' | 'actuators', string>>

/** Fields of a request for a proposal; the server reports numbers that are none. */
export function hintsOf({ locks, feet, mass, actuators }: Hints) {
  return {
    locks: pairs(locks, Number),
    feet: pairs(feet, (at) => at.split(',').map(Number) as [number, number, number]),
    mass: mass.trim() === '' ? null : Number(mass),
    actuators: pairs(actuators, String),
  }
}

function pairs<Value>(text: string, read: (value: string) => Value): Record<string, Value> {
  const entries = text.split(/\s+/).filter((entry) => entry !== '')
  return Object.fromEntries(
    entries.map((entry) => {
      const at = entry.lastIndexOf('=')
      return [entry.slice(0, at), read(entry.slice(at + 1))]
    }),
  )
}

export const ROBOT_FILES = '.urdf,.xacro,.xml,.mjcf'

let handed: File | null = null

/** Pass a file on to the form of a new job. */
export function handOver(file: File): void {
  handed = file
}

/** The file handed over, once. */
export function takeHanded(): File | null {
  const file = handed
  handed = null
  return file
}

/** Size limit for any file [B]; the API has lower limits and reports them. */
const MOST_BYTES = 4_000_000

/** Read a text file. Throws a message for the user. */
export async function textOf(file: File): Promise<string> {
  if (file.size > MOST_BYTES) {
    throw new Error(
      `${file.name} has ${(file.size / 1e6).toFixed(1)} MB; robot files are text of at most 0.8 MB.` +
        ' Choose the URDF itself; meshes are not needed',
    )
  }
  let bytes: ArrayBuffer
  try {
    bytes = await file.arrayBuffer()
  } catch {
    throw new Error(`cannot read ${file.name}; it may have changed: choose it again`)
  }
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes)
  } catch {
    throw new Error(`${file.name} is not UTF-8 text; choose another file, or save it as UTF-8`)
  }
}

/** Name of a robot derived from its file name, restricted to allowed characters. */
export function robotName(file: string): string {
  const stem = file.replace(/\.[^.]*$/, '')
  const allowed = stem.replace(/[^\p{L}\p{N}_. -]/gu, '').replace(/^[^\p{L}\p{N}_]+/u, '')
  return allowed.slice(0, 100).trim() || 'robot'
}

/** Middle of the search space: fixed values stay; categorical variables take their first choice. variables: all of the controller. */
export function startDesign(spec: JobSpec, variables: readonly Variable[]): Design {
  const kinds = new Map(variables.map((variable) => [variable.name, variable]))
  const searched = (spec.variables ?? []).map((entry) => {
    const variable =
      typeof entry === 'string' ? kinds.get(entry) : { ...kinds.get(entry.name), ...entry }
    const name = typeof entry === 'string' ? entry : entry.name
    return [name, variable ? middle(variable as Variable) : Number.NaN] as const
  })
  return { ...Object.fromEntries(searched), ...spec.fixed } as Design
}
