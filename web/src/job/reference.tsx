/** What a job's winner is compared with: a published design, or the winner of another job. */

import { useMemo } from 'preact/hooks'
import { get, post } from '../api/client'
import { jobsOfKind } from '../api/jobs-of-kind'
import { readableJob } from '../api/readable'
import { useResource } from '../api/resource'
import { isPublished, NOT_PUBLISHED } from '../api/robots'
import type { Controller, Job, JobSpec, ScenarioResult, Simulation } from '../api/types'
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
  onChoose,
}: {
  job: Job
  choice: string
  onChoose: (choice: string) => void
}) {
  const tuning = job.kind === 'tuning'
  const hasPublished = tuning && isPublished((job.spec as JobSpec).robot)
  const published = useResource(hasPublished ? 'controllers' : null, catalogue)
  const others = useResource(`others ${job.kind}`, (signal) => jobsOfKind(job.kind, signal))
  const jobs = useMemo(
    () => (others.data ?? []).filter((other) => other.id !== job.id && other.best_fitness !== null),
    [others.data, job.id, job.kind],
  )
  return (
    <label class="row">
      <span class="label">Compare with</span>
      <select value={choice} onChange={(event) => onChoose(event.currentTarget.value)}>
        <option value="none">nothing</option>
        {hasPublished && (
          <optgroup label="Published designs">
            {(published.data ?? []).flatMap((controller) =>
              Object.keys(controller.published).map((study) => (
                <option
                  key={`${controller.name}:${study}`}
                  value={`published:${controller.name}:${study}`}
                >
                  {controller.name}, {study}
                </option>
              )),
            )}
          </optgroup>
        )}
        <optgroup label="Winners of other jobs">
          {jobs.map((other) => (
            <option key={other.id} value={`job:${other.id}`}>
              {other.name || other.id}
              {other.name ? ` (${other.id})` : ''}
            </option>
          ))}
        </optgroup>
      </select>
      {tuning && !hasPublished && <span class="muted small">{NOT_PUBLISHED}</span>}
    </label>
  )
}
