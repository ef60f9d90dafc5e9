/** All jobs of the server, kept up to date with few requests. */

import type { JobSummary } from '../api/types'

export interface JobPage {
  readonly items: readonly JobSummary[]
  readonly next: string | null
}

/** Asks for one page: newest first, from the start or after a cursor, or of one state only. */
export type FetchJobs = (query: {
  after?: string
  state?: 'running' | 'pausing'
  limit: number
}) => Promise<JobPage>

const PAGE = 200
/** More would be slow to look through; the server's own search finds the others. */
const MOST = 5000

/**
 * Jobs by id, newest first.
 *
 * | call | asks for | afterwards |
 * | --- | --- | --- |
 * | loadAll() | every page | all jobs are there; those that vanished are gone |
 * | refresh() | the first page, and what runs | new jobs and all progress are there |
 */
export class JobList {
  private jobs = new Map<string, JobSummary>()
  /** Whether there are older jobs than those loaded. */
  truncated = false

  constructor(
    private readonly fetchJobs: FetchJobs,
    /** Called with every new state of the list. */
    private readonly changed: (jobs: readonly JobSummary[]) => void,
  ) {}

  /** Load everything, showing each page as it comes. */
  async loadAll(): Promise<void> {
    const found = new Map<string, JobSummary>()
    let after: string | undefined
    do {
      const page = await this.fetchJobs({ after, limit: PAGE })
      for (const job of page.items) found.set(job.id, job)
      after = page.next ?? undefined
      this.truncated = after !== undefined
      this.merge(page.items)
    } while (after !== undefined && found.size < MOST)
    this.jobs = found
    this.tell()
  }

  /** Renew what is likely to have changed: the newest jobs, and those that run. */
  async refresh(): Promise<void> {
    const pages = await Promise.all([
      this.fetchJobs({ limit: 50 }),
      this.fetchJobs({ state: 'running', limit: PAGE }),
      this.fetchJobs({ state: 'pausing', limit: PAGE }),
    ])
    const fresh = new Map(pages.flatMap((page) => page.items.map((job) => [job.id, job])))
    // What ran a moment ago and is in no answer has changed its state: ask for all of it once.
    const lost = [...this.jobs.values()].some((job) => isActive(job) && !fresh.has(job.id))
    if (lost) await this.loadAll()
    else this.merge([...fresh.values()])
  }

  private merge(items: readonly JobSummary[]): void {
    for (const job of items) this.jobs.set(job.id, job)
    this.tell()
  }

  private tell(): void {
    const newestFirst = (a: JobSummary, b: JobSummary) =>
      a.created_at < b.created_at ? 1 : a.created_at > b.created_at ? -1 : 0
    this.changed([...this.jobs.values()].sort(newestFirst))
  }
}

function isActive(job: JobSummary): boolean {
  return job.state === 'running' || job.state === 'pausing'
}
