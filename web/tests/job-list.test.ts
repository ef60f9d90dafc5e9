import { expect, test } from 'vitest'
import type { JobSummary } from '../src/api/types'
import { type FetchJobs, JobList } from '../src/jobs/job-list'

/** A server of jobs, of which the newest has the highest number. */
class Server {
  jobs: JobSummary[] = []
  asked: string[] = []

  add(number: number, state: JobSummary['state']): void {
    const id = `job-${String(number).padStart(4, '0')}`
    this.jobs.unshift({ id, state, created_at: id } as JobSummary)
  }

  fetch: FetchJobs = async ({ after, state, limit }) => {
    this.asked.push(state ?? after ?? 'first')
    const found = this.jobs.filter((job) => state === undefined || job.state === state)
    const start = after === undefined ? 0 : Number(after)
    const next = start + limit < found.length ? String(start + limit) : null
    return { items: found.slice(start, start + limit), next }
  }
}

function setUp(count: number) {
  const server = new Server()
  for (let number = 0; number < count; number++) server.add(number, 'succeeded')
  const shown: (readonly JobSummary[])[] = []
  const list = new JobList(server.fetch, (jobs) => shown.push(jobs))
  return { server, list, shown, last: () => shown.at(-1)! }
}

test('a thousand jobs are loaded page by page, the first page shown at once', async () => {
  const { list, shown, last } = setUp(1000)
  await list.loadAll()
  expect(shown[0]).toHaveLength(200)
  expect(last()).toHaveLength(1000)
  expect(last()[0].id).toBe('job-0999')
  expect(list.truncated).toBe(false)
})

test('a refresh brings new jobs and progress without loading everything', async () => {
  const { server, list, last } = setUp(1000)
  await list.loadAll()
  server.asked = []
  server.add(1000, 'running')
  await list.refresh()
  expect(last()).toHaveLength(1001)
  expect(server.asked).toHaveLength(3)
})

test('an old job that ended is found again', async () => {
  const { server, list, last } = setUp(0)
  server.add(0, 'running')
  for (let number = 1; number < 300; number++) server.add(number, 'succeeded')
  await list.loadAll()
  server.jobs = server.jobs.map((job) =>
    job.state === 'running' ? { ...job, state: 'failed' as const } : job,
  )
  await list.refresh()
  expect(last().at(-1)?.state).toBe('failed')
})

test('of very many jobs the newest are loaded, and that is said', async () => {
  const { list, last } = setUp(6000)
  await list.loadAll()
  expect(last()).toHaveLength(5000)
  expect(list.truncated).toBe(true)
})
