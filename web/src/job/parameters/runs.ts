/** Which jobs may be further runs of the same fit. Pure. */

import type { Job, JobSummary } from '../../api/types'

/** Runs that the API compares at once, besides the first. */
export const MOST_RUNS = 31

/** Job ids of an address such as `?also=a,b`, each once, without the job itself. */
export function runsOf(query: URLSearchParams, own: string): readonly string[] {
  const named = (query.get('also') ?? '').split(',').map((id) => id.trim())
  return [...new Set(named)].filter((id) => id !== '' && id !== own).slice(0, MOST_RUNS)
}

/** The query of such an address; null for none. */
export function wordOfRuns(ids: readonly string[]): string | null {
  return ids.length === 0 ? null : ids.join(',')
}

/** Other jobs of the same kind: those with a design that were fitted to the same, and the others. */
export function candidates(
  jobs: readonly JobSummary[],
  own: Pick<JobSummary, 'id' | 'kind' | 'scenarios'>,
): { readonly same: readonly JobSummary[]; readonly others: readonly JobSummary[] } {
  const cases = (job: { readonly scenarios: readonly string[] }) => [...job.scenarios].sort().join()
  const fitted = jobs.filter((job) => job.kind === own.kind && job.id !== own.id)
  const isSame = (job: JobSummary) => cases(job) === cases(own)
  return {
    same: fitted.filter((job) => isSame(job) && job.best_fitness !== null),
    others: fitted.filter((job) => !isSame(job) || job.best_fitness === null),
  }
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
