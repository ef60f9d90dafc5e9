/** Which jobs may be further runs of the same fit. Pure. */

import type { Job, JobSummary } from '../../api/types'
import { idsOf } from '../../router/query-value'

/** Runs that the API compares at once, besides the first. */
export const MOST_RUNS = 31

/** Job ids of an address such as `?also=a,b`, each once, without the job itself. */
export function runsOf(query: URLSearchParams, own: string): readonly string[] {
  return idsOf(query.get('also'))
    .filter((id) => id !== own)
    .slice(0, MOST_RUNS)
}

/** The query of such an address; null for none. */
export function wordOfRuns(ids: readonly string[]): string | null {
  return ids.length === 0 ? null : ids.join(',')
}

type Fitted = Pick<JobSummary, 'kind' | 'scenarios'>

/** Whether two jobs are of one kind and were fitted to the same. */
export function isSameFit(one: Fitted, other: Fitted): boolean {
  const cases = (job: Fitted) => [...job.scenarios].sort().join()
  return one.kind === other.kind && cases(one) === cases(other)
}

/** Other jobs that were fitted to the same and have a design. */
export function furtherRuns(
  jobs: readonly JobSummary[],
  own: Fitted & Pick<JobSummary, 'id'>,
): readonly JobSummary[] {
  return jobs.filter((job) => job.id !== own.id && job.best_fitness !== null && isSameFit(job, own))
}

/** Short names of runs: their seeds where these tell them apart, else their ids. */
export function labelsOf(ids: readonly string[], jobs: readonly Job[]): readonly string[] {
  const seeds = ids.map((id) => jobs.find((job) => job.id === id)?.spec.seed)
  const known = seeds.filter((seed) => seed !== undefined)
  const apart = known.length === ids.length && new Set(known).size === known.length
  return ids.map((id, k) => (apart ? `seed ${seeds[k]}` : id))
}

/** Seeds that more than one run has. */
export function repeatedSeeds(jobs: readonly Job[]): readonly number[] {
  const seeds = jobs.map((job) => job.spec.seed)
  return [...new Set(seeds.filter((seed, k) => seeds.indexOf(seed) !== k))]
}
