/** Runs of the same fit. */

import type { Job, JobSummary } from '../../api/types'
import { idsOf } from '../../router/query-value'

/** Most runs that the API compares, besides the first. */
export const MOST_RUNS = 31

/** Distinct job ids of a query such as `?also=a,b`, without the job itself. */
export function runsOf(query: URLSearchParams, job: string): readonly string[] {
  return idsOf(query.get('also'))
    .filter((id) => id !== job)
    .slice(0, MOST_RUNS)
}

type Fitted = Pick<JobSummary, 'kind' | 'scenarios'>

/** Whether two jobs are of the same kind and fitted to the same data. */
export function isSameFit(one: Fitted, other: Fitted): boolean {
  const cases = (job: Fitted) => [...job.scenarios].sort().join()
  return one.kind === other.kind && cases(one) === cases(other)
}

export function furtherRuns(
  jobs: readonly JobSummary[],
  reference: Fitted & Pick<JobSummary, 'id'>,
): readonly JobSummary[] {
  return jobs.filter(
    (job) => job.id !== reference.id && job.best_fitness !== null && isSameFit(job, reference),
  )
}

/** Short labels of runs: their seeds if distinct, otherwise their ids. */
export function labelsOf(ids: readonly string[], jobs: readonly Job[]): readonly string[] {
  const seeds = ids.map((id) => jobs.find((job) => job.id === id)?.spec.seed)
  const knownSeeds = seeds.filter((seed) => seed !== undefined)
  const distinct =
    knownSeeds.length === ids.length && new Set(knownSeeds).size === knownSeeds.length
  return ids.map((id, k) => (distinct ? `seed ${seeds[k]}` : id))
}

export function repeatedSeeds(jobs: readonly Job[]): readonly number[] {
  const seeds = jobs.map((job) => job.spec.seed)
  return [...new Set(seeds.filter((seed, k) => seeds.indexOf(seed) !== k))]
}
