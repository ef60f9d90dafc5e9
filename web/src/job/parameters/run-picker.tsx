/** Choice of the runs to compare: this job and others with the same fit. */

import { get } from '../../api/client'
import { jobSearch } from '../../api/job-search'
import { useResource } from '../../api/resource'
import type { Job, JobSummary } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { Combobox } from '../../components/fields/combobox'
import { formatCount, quantity } from '../../format/number'
import { jobPath, withQuery } from '../../router/routes'
import { caseWords, fitnessUnit } from '../fitness'
import { furtherRuns, isSameFit, MOST_RUNS, repeatedSeeds } from './runs'

/** Number of newest jobs searched for runs of the same fit. */
const OFFERED = 100

export function RunPicker({
  job,
  runs,
  also,
  onChoose,
}: {
  job: Job
  /** The compared runs loaded so far. */
  runs: readonly Job[]
  /** Ids of the runs compared with the job. */
  also: readonly string[]
  onChoose: (also: readonly string[]) => void
}) {
  const listed = useResource(`fits ${job.kind}`, (signal) =>
    get('/v1/jobs', { query: { kind: job.kind, limit: OFFERED }, signal }),
  )
  const words = caseWords(job.kind)
  const same = furtherRuns(listed.data?.items ?? [], job)
  const offered = new Set(same.map(({ id }) => id))
  const added = also.filter((id) => !offered.has(id))
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
        <h2 id="runs">Compared runs</h2>
        <span class="row">
          {all.length > 0 && all.some((id) => !also.includes(id)) && (
            <button type="button" class="compact primary" onClick={() => onChoose(all)}>
              {listed.data?.next
                ? `Compare the ${all.length + 1} runs listed here`
                : `Compare all ${all.length + 1} runs on these ${words.items}`}
            </button>
          )}
          <a class="button compact" href={nextRun(job, [...runs])}>
            Run with another seed
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
          chosenLabel=""
          placeholder="name, id, note or tag"
          hint={
            listed.data?.next
              ? `Listed above: runs among the newest ${OFFERED} jobs on these ${words.items}. Search for others here.`
              : undefined
          }
          remote={{
            label: 'Jobs, newest first',
            search: jobSearch(job.kind, {
              exclude: [job.id, ...also],
              note: (other) => (isSameFit(other, job) ? '' : `different ${words.items}`),
            }),
          }}
          onChoose={(id) => toggle(id, true)}
        />
      )}
      {repeated.length > 0 && (
        <p class="notice" data-tone="warn">
          Seed {repeated.join(' and ')} occurs more than once. Identical runs always agree, which
          proves nothing.
        </p>
      )}
      {listed.error && (
        <ErrorNotice what="Could not load other runs." error={listed.error} retry={listed.reload} />
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
  /** Whether the maximum number of runs is selected. */
  full: boolean
  onToggle: (chosen: boolean) => void
}) {
  const details = summary ?? job
  return (
    <li data-run={id}>
      <label class="check">
        <input
          type="checkbox"
          checked={chosen}
          disabled={!chosen && full}
          onChange={(event) => onToggle(event.currentTarget.checked)}
        />
        {details?.name ? `${details.name} (${id})` : id}
      </label>
      {details && <span class="muted small">{described(details, job?.spec.seed)}</span>}
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

/** New-job form of the same job with an unused seed. */
function nextRun(job: Job, runs: readonly Job[]): string {
  const seed = Math.max(...runs.map(({ spec }) => spec.seed ?? 0)) + 1
  return withQuery('/jobs/new', { clone: job.id, seed })
}
