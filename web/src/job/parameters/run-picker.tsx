/** Choice of the runs to compare: this job and others with the same fit. */

import { get } from '../../api/client'
import { jobSearch } from '../../api/jobs'
import { useResource } from '../../api/resource'
import type { Job, JobSummary } from '../../api/types'
import { Card } from '../../components/card'
import { ErrorNotice } from '../../components/feedback'
import { Combobox } from '../../components/fields/combobox'
import { Check } from '../../components/fields/controls'
import { formatCount, quantity } from '../../format/number'
import { jobPath, withQuery } from '../../router/routes'
import { caseWords, fitnessUnit } from '../facts'
import { furtherRuns, isSameFit, MOST_RUNS, repeatedSeeds } from './runs'

const OFFERED = 100

interface RunPickerProps {
  job: Job
  runs: readonly Job[]
  others: readonly string[]
  onSelect: (others: readonly string[]) => void
}

/** others: ids of the runs compared with the job; runs: the compared ones loaded so far. */
export function RunPicker({ job, runs, others, onSelect }: RunPickerProps) {
  const listed = useResource(`fits ${job.kind}`, (signal) =>
    get('/v1/jobs', { query: { kind: job.kind, limit: OFFERED }, signal }),
  )
  const { items } = caseWords(job.kind)
  const same = furtherRuns(listed.data?.items ?? [], job)
  const offered = same.map(({ id }) => id)
  const added = listed.data ? others.filter((id) => !offered.includes(id)) : []
  const all = offered.slice(0, MOST_RUNS)
  const repeated = repeatedSeeds(runs)
  const unusedSeed = Math.max(...runs.map(({ spec }) => spec.seed ?? 0)) + 1
  const toggle = (id: string, on: boolean) =>
    onSelect(on ? [...others, id] : others.filter((each) => each !== id))
  const run = (id: string, summary?: JobSummary) => {
    const loaded = runs.find((each) => each.id === id)
    const details = summary ?? loaded
    const selected = others.includes(id)
    return (
      <li key={id} data-run={id}>
        <Check
          small={false}
          label={details?.name ? `${details.name} (${id})` : id}
          checked={selected}
          disabled={!selected && others.length >= MOST_RUNS}
          onChange={(on) => toggle(id, on)}
        />
        {details && <span class="muted small">{described(details, loaded?.spec.seed)}</span>}
        <a class="small" href={jobPath(id)} aria-label={`Open job ${id}`}>
          open
        </a>
      </li>
    )
  }
  return (
    <Card
      class="run-card"
      title="Compared runs"
      tools={
        <span class="row">
          {all.some((id) => !others.includes(id)) && (
            <button type="button" class="compact primary" onClick={() => onSelect(all)}>
              {listed.data?.next
                ? `Compare the ${all.length + 1} runs listed here`
                : `Compare all ${all.length + 1} runs on these ${items}`}
            </button>
          )}
          <a
            class="button compact"
            href={withQuery('/jobs/new', { clone: job.id, seed: unusedSeed })}
          >
            Run with another seed
          </a>
        </span>
      }
    >
      <ul class="runs">
        <li>
          <label class="check">
            <input type="checkbox" checked disabled />
            <strong>{job.name || job.id}</strong> (this job)
          </label>
          <span class="muted small">{described(job, job.spec.seed)}</span>
        </li>
        {same.map((each) => run(each.id, each))}
        {added.map((id) => run(id))}
      </ul>
      {others.length < MOST_RUNS && (
        <Combobox
          label="Add a run"
          placeholder="name, id, note or tag"
          hint={
            listed.data?.next
              ? `Listed above: runs among the newest ${OFFERED} jobs on these ${items}. Search for others here.`
              : undefined
          }
          remote={{
            label: 'Jobs, newest first',
            search: jobSearch(job.kind, {
              exclude: [job.id, ...others],
              note: (other) => (isSameFit(other, job) ? '' : `different ${items}`),
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
    </Card>
  )
}

function described(job: JobSummary | Job, seed: number | undefined): string {
  const fitness =
    job.best_fitness === null
      ? 'no parameters yet'
      : `fitness ${quantity(job.best_fitness, fitnessUnit(job))}`
  const parts = [
    seed !== undefined && `seed ${seed}`,
    fitness,
    `${formatCount(job.iterations)} iterations`,
    job.state !== 'succeeded' && job.state,
  ]
  return parts.filter(Boolean).join(' · ')
}
