/** What a job's winner is compared with: a published design, or the winner of another job. */

import { get, post } from '../api/client'
import { foundJobs } from '../api/found-jobs'
import { readableJob } from '../api/readable'
import { useResource } from '../api/resource'
import { isPublished, NOT_PUBLISHED } from '../api/robots'
import type { Controller, Job, JobSpec, ScenarioResult, Simulation } from '../api/types'
import { Combobox } from '../components/fields/combobox'
import type { Design } from '../format/value'

export interface Reference {
  readonly label: string
  readonly scenarios: Readonly<Record<string, ScenarioResult>>
}

const simulated = new Map<string, Promise<Simulation>>()

/** A choice as it stands in the address bar: `published:fuzzy-pi:A`, `job:k2q7`, `none`. */
export function useReference(job: Job, choice: string) {
  const key = choice === 'none' ? null : `${job.id} ${choice}`
  return useResource<Reference>(key, (signal) => load(job, choice, signal))
}

async function load(job: Job, choice: string, signal: AbortSignal): Promise<Reference> {
  const [kind, name, study] = choice.split(':')
  if (kind === 'job') {
    const other = await readableJob(name, signal)
    if (!other.best) throw new Error('that job has no design yet that walks in every scenario')
    return { label: other.name || other.id, scenarios: other.best.scenarios }
  }
  const controllers = await catalogue()
  if (!isPublished((job.spec as JobSpec).robot)) throw new Error(NOT_PUBLISHED)
  const design = controllers.find((c) => c.name === name)?.published[study]
  if (!design) throw new Error(`there is no published design ${study} of ${name}`)
  const result = await walkOf(job.spec as JobSpec, name as JobSpec['controller'], design)
  return { label: `published ${study}`, scenarios: result.scenarios }
}

/** The published designs of the job's controller, walking in its scenarios. */
export async function publishedWalks(job: Job): Promise<readonly Reference[]> {
  const spec = job.spec as JobSpec
  const found = (await catalogue()).find(({ name }) => name === spec.controller)
  const walks = Object.entries(found?.published ?? {}).map(async ([study, design]) => {
    const { scenarios } = await walkOf(spec, spec.controller, design)
    return { label: `published ${study}`, scenarios }
  })
  return Promise.all(walks)
}

let controllers: Promise<readonly Controller[]> | null = null

function catalogue(): Promise<readonly Controller[]> {
  controllers ??= get('/v1/controllers').then((answer) => answer.items)
  controllers.catch(() => {
    controllers = null
  })
  return controllers
}

/** The design walking in the job's scenarios; the same question is asked once. */
function walkOf(
  { robot, scenarios, preference }: JobSpec,
  controller: JobSpec['controller'],
  design: Design,
): Promise<Simulation> {
  const walks = { scenarios, preference, precision: 'double' as const, log: false }
  const body = { robot, controller, design: { ...design }, ...walks }
  const key = JSON.stringify(body)
  const known = simulated.get(key)
  if (known) return known
  const asked = post('/v1/simulations', { body })
  simulated.set(key, asked)
  asked.catch(() => simulated.delete(key))
  return asked
}

export function ReferencePicker({
  job,
  choice,
  label,
  onChoose,
}: {
  job: Job
  choice: string
  /** What the reference is called, once it is known. */
  label: string | null
  onChoose: (choice: string) => void
}) {
  const tuning = job.kind === 'tuning'
  const hasPublished = tuning && isPublished((job.spec as JobSpec).robot)
  const published = useResource(hasPublished ? 'controllers' : null, catalogue)
  const groups = [{ label: '', choices: [{ value: 'none', label: 'nothing' }] }]
  if (hasPublished) groups.push({ label: 'Published designs', choices: designs(published.data) })
  const known = groups.flatMap(({ choices }) => choices).find(({ value }) => value === choice)
  return (
    <Combobox
      label="Compare with"
      shown={known?.label ?? label ?? choice.slice(choice.indexOf(':') + 1)}
      hint={tuning && !hasPublished ? NOT_PUBLISHED : undefined}
      groups={groups}
      found={{
        label: 'Winners of other jobs',
        search: foundJobs(job.kind, { without: [job.id], value: (id) => `job:${id}` }),
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
