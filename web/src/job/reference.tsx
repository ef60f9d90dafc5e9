/** Reference for a job's winner: a published design, or the winner of another job. */

import { get, post } from '../api/client'
import { isPublished, jobSearch, NOT_PUBLISHED, readableJob } from '../api/jobs'
import { cached, useResource } from '../api/resource'
import type {
  Controller,
  Job,
  JobSpec,
  ReferenceView,
  ScenarioResult,
  Simulation,
} from '../api/types'
import { Combobox } from '../components/fields/combobox'
import type { Design } from '../format/value'

export interface Reference {
  readonly label: string
  readonly scenarios: Readonly<Record<string, ScenarioResult>>
}

/** The job's own reference as an address value; null if it has none. */
export function ownReference({ kind, spec }: Job, reference: ReferenceView | null): string | null {
  if (kind !== 'tuning' || !reference) return null
  if (reference.kind === 'start') return 'start'
  return `published:${(spec as JobSpec).controller}:${reference.name}`
}

/** Load the reference for an address value: `published:fuzzy-pi:A`, `job:k2q7`, `start`, `none`. */
export function useReference(job: Job, choice: string) {
  const key = choice === 'none' ? null : `${job.id} ${choice}`
  return useResource<Reference>(key, (signal) => load(job, choice, signal))
}

async function load(job: Job, choice: string, signal: AbortSignal): Promise<Reference> {
  const [kind, name, study] = choice.split(':')
  if (kind === 'job') {
    const other = await readableJob(name, signal)
    if (!other.best) throw new Error('that job has no feasible design yet')
    return { label: other.name || other.id, scenarios: other.best.scenarios }
  }
  if (kind === 'start') return startOf(job, signal)
  const controllers = await catalogue()
  if (!isPublished((job.spec as JobSpec).robot)) throw new Error(NOT_PUBLISHED)
  const design = controllers.find((c) => c.name === name)?.published[study]
  if (!design) throw new Error(`there is no published design ${study} of ${name}`)
  const result = await walkOf(job.spec as JobSpec, name as JobSpec['controller'], design)
  return { label: `published ${study}`, scenarios: result.scenarios }
}

/** The start design, as far as the verdict compares it. */
async function startOf({ id }: Job, signal: AbortSignal): Promise<Reference> {
  const path = { job_id: id }
  const { reference, quantities } = await get('/v1/jobs/{job_id}/verdict', { path, signal })
  const scenarios: Record<string, ScenarioResult> = {}
  for (const { name, scenarios: figures } of quantities) {
    for (const [scenario, { reference: value }] of Object.entries(figures)) {
      scenarios[scenario] ??= { status: 'ok', explanation: '', utility: null, objectives: {} }
      const [objective, measured] =
        name === 'speed' ? ['reciprocal_speed', 1 / value] : [name, value]
      scenarios[scenario].objectives[objective] = measured
    }
  }
  return { label: reference?.name ?? 'start design', scenarios }
}

export async function publishedReferences(job: Job): Promise<readonly Reference[]> {
  const spec = job.spec as JobSpec
  const match = (await catalogue()).find(({ name }) => name === spec.controller)
  const walks = Object.entries(match?.published ?? {}).map(async ([study, design]) => {
    const { scenarios } = await walkOf(spec, spec.controller, design)
    return { label: `published ${study}`, scenarios }
  })
  return Promise.all(walks)
}

function catalogue(): Promise<readonly Controller[]> {
  return cached('controllers', () => get('/v1/controllers').then(({ items }) => items))
}

function walkOf(
  { robot, scenarios, preference }: JobSpec,
  controller: JobSpec['controller'],
  design: Design,
): Promise<Simulation> {
  const walks = { scenarios, preference, precision: 'double' as const, log: false }
  const body = { robot, controller, design: { ...design }, ...walks }
  return cached(JSON.stringify(body), () => post('/v1/simulations', { body }))
}

interface ReferencePickerProps {
  job: Job
  /** As an address value. */
  own: string | null
  choice: string
  label: string | null
  onChoose: (choice: string) => void
}

export function ReferencePicker({ job, own, choice, label, onChoose }: ReferencePickerProps) {
  const tuning = job.kind === 'tuning'
  const hasPublished = tuning && isPublished((job.spec as JobSpec).robot)
  const published = useResource(hasPublished ? 'controllers' : null, catalogue)
  const groups = [{ label: '', choices: [{ value: 'none', label: 'nothing' }] }]
  if (own === 'start') groups[0].choices.push({ value: 'start', label: 'start design' })
  if (hasPublished) groups.push({ label: 'Published designs', choices: designs(published.data) })
  const selected = groups.flatMap(({ choices }) => choices).find(({ value }) => value === choice)
  return (
    <Combobox
      label="Compare with"
      selected={selected?.label ?? label ?? choice.slice(choice.indexOf(':') + 1)}
      hint={tuning && !hasPublished ? NOT_PUBLISHED : undefined}
      groups={groups}
      remote={{
        label: 'Winners of other jobs',
        search: jobSearch(job.kind, { exclude: [job.id], value: (id) => `job:${id}` }),
      }}
      onChoose={onChoose}
    />
  )
}

function designs(controllers: readonly Controller[] | null) {
  return (controllers ?? []).flatMap(({ name, published }) =>
    Object.keys(published).map((study) => ({
      value: `published:${name}:${study}`,
      label: `${name}, ${study}`,
    })),
  )
}
