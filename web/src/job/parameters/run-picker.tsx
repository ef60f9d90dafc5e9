/** The runs that are compared: this job, and others that may have fitted the same. */

import { get } from '../../api/client'
import { foundJobs } from '../../api/found-jobs'
import { useResource } from '../../api/resource'
import type { Job, JobSummary } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { Combobox } from '../../components/fields/combobox'
import { formatCount, quantity } from '../../format/number'
import { jobPath, withQuery } from '../../router/routes'
import { caseWords, fitnessUnit } from '../fitness'
import { furtherRuns, isSameFit, MOST_RUNS, repeatedSeeds } from './runs'

/** Newest jobs among which runs of the same fit are offered; a search finds all others. */
const OFFERED = 100

export function RunPicker({
  job,
  runs,
  also,
  onChoose,
}: {
  job: Job
  /** Those compared, as far as they are known. */
  runs: readonly Job[]
  /** Ids of those compared with the job. */
  also: readonly string[]
  onChoose: (also: readonly string[]) => void
}) {
  const listed = useResource(`fits ${job.kind}`, (signal) =>
    get('/v1/jobs', { query: { kind: job.kind, limit: OFFERED }, signal }),
  )
  const words = caseWords(job.kind)
  const same = furtherRuns(listed.data?.items ?? [], job)
  const known = new Set(same.map(({ id }) => id))
  const added = also.filter((id) => !known.has(id))
  const all = same.map(({ id }) => id).slice(0, MOST_RUNS)
  const repeated = repeatedSeeds(runs)
  const toggle = (id: string, on: boolean) =>
    onChoose(on ? [...also, id] : also.filter((each) => each !== id))
  const run = (other: JobSummary | string) => {
    const id = typeof other === 'string' ? other : other.id
    return (
      <Run
        key={id}
        id={id}
        summary={typeof other === 'string' ? null : other}
        job={runs.find((each) => each.id === id) ?? null}
        chosen={also.includes(id)}
        full={also.length >= MOST_RUNS}
        onToggle={(on) => toggle(id, on)}
      />
    )
  }
  return (
    <section class="card run-card" aria-labelledby="runs">
      <header class="row spread">
        <h2 id="runs">Runs that are compared</h2>
        <span class="row">
          {all.length > 0 && all.some((id) => !also.includes(id)) && (
            <button type="button" class="compact primary" onClick={() => onChoose(all)}>
              {listed.data?.next
                ? `Compare the ${all.length + 1} runs listed here`
                : `Compare all ${all.length + 1} runs on these ${words.many}`}
            </button>
          )}
          <a class="button compact" href={nextRun(job, [...runs])}>
            Run it with another seed
          </a>
        </span>
      </header>
      <ul class="runs">
        <li>
          <label class="check">
            <input type="checkbox" checked disabled />
            <strong>{job.name || job.id}</strong> (this job)
          </label>
          <span class="muted small">{described(job, job.spec.seed)}</span>
        </li>
        {same.map(run)}
        {listed.data && added.map(run)}
      </ul>
      {also.length < MOST_RUNS && (
        <Combobox
          label="Add a run"
          shown=""
          placeholder="name, id, note or tag"
          hint={
            listed.data?.next
              ? `Above: those of the newest ${OFFERED} jobs on these ${words.many}. All others are found here.`
              : undefined
          }
          found={{
            label: 'Jobs, the newest first',
            search: foundJobs(job.kind, {
              without: [job.id, ...also],
              note: (other) => (isSameFit(other, job) ? '' : `other ${words.many}`),
            }),
          }}
          onChoose={(id) => toggle(id, true)}
        />
      )}
      {repeated.length > 0 && (
        <p class="notice" data-tone="warn">
          Seed {repeated.join(' and ')} occurs more than once. Runs that differ in nothing are the
          same run: their agreement says nothing.
        </p>
      )}
      {listed.error && (
        <ErrorNotice
          what="Other runs cannot be listed."
          error={listed.error}
          retry={listed.reload}
        />
      )}
    </section>
  )
}

function Run({
  id,
  summary,
  job,
  chosen,
  full,
  onToggle,
}: {
  id: string
  summary: JobSummary | null
  job: Job | null
  chosen: boolean
  /** Whether no more can be chosen. */
  full: boolean
  onToggle: (chosen: boolean) => void
}) {
  const known = summary ?? job
  return (
    <li data-run={id}>
      <label class="check">
        <input
          type="checkbox"
          checked={chosen}
          disabled={!chosen && full}
          onChange={(event) => onToggle(event.currentTarget.checked)}
        />
        {known?.name ? `${known.name} (${id})` : id}
      </label>
      {known && <span class="muted small">{described(known, job?.spec.seed)}</span>}
      <a class="small" href={jobPath(id)} aria-label={`Open job ${id}`}>
        open
      </a>
    </li>
  )
}

function described(job: JobSummary | Job, seed: number | undefined): string {
  const fitness =
    job.best_fitness === null
      ? 'no parameters yet'
      : `fitness ${quantity(job.best_fitness, fitnessUnit(job))}`
  const parts = [
    seed === undefined ? null : `seed ${seed}`,
    fitness,
    `${formatCount(job.iterations)} iterations`,
    job.state === 'succeeded' ? null : job.state,
  ]
  return parts.filter((part) => part !== null).join(' · ')
}

/** The form of the same job with a seed that none of the runs has. */
function nextRun(job: Job, runs: readonly Job[]): string {
  const seed = Math.max(...runs.map(({ spec }) => spec.seed ?? 0)) + 1
  return withQuery('/jobs/new', { clone: job.id, seed })
}
