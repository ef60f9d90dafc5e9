/** Activity of a job: timeline of its tasks, workers, and log. */

import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type { Activity, Job } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatNumber } from '../../format/number'
import { formatMoment } from '../../format/time'
import { sentence } from '../../format/words'
import { oneOf, useQueryValue } from '../../router/query-value'
import './activity.css'
import { TimelineCard } from './timeline-card'

const POLL_MS = 2000
const LEVELS = ['DEBUG', 'INFO', 'WARNING', 'ERROR'] as const
type Level = (typeof LEVELS)[number]
const LEVEL = oneOf<Level>(LEVELS, 'INFO')

export function ActivityPanel({ job }: { job: Job }) {
  const [level, setLevel] = useQueryValue('level', LEVEL, 'INFO')
  const activity = useResource(`activity ${job.id} ${level} ${job.state}`, (signal) =>
    get('/v1/jobs/{job_id}/activity', { path: { job_id: job.id }, query: { level }, signal }),
  )
  usePolling(activity.reload, POLL_MS, ['queued', 'running', 'pausing'].includes(job.state))
  if (activity.error && !activity.data) {
    return (
      <ErrorNotice
        what="Could not load the activity."
        error={activity.error}
        retry={activity.reload}
      />
    )
  }
  if (!activity.data) return <Loading what="the activity" />
  if (activity.data.reason !== null) {
    return (
      <section class="card">
        <Empty title="No activity recorded">
          <p>{sentence(activity.data.reason)}</p>
        </Empty>
      </section>
    )
  }
  return (
    <div class="stack">
      <TimelineCard activity={activity.data} />
      <div class="grid">
        <WorkersCard workers={activity.data.workers} />
        <LogCard messages={activity.data.messages} level={level} onLevel={setLevel} />
      </div>
    </div>
  )
}

type Worker = Activity['workers'][number]

function counted(key: 'tasks' | 'walks' | 'failures', label: string): Column<Worker> {
  return {
    key,
    label,
    numeric: true,
    value: (worker) => worker[key],
    cell: (worker) => formatCount(worker[key]),
  }
}

const WORKER_COLUMNS: readonly Column<Worker>[] = [
  {
    key: 'name',
    label: 'Machine',
    header: true,
    value: ({ name }) => name,
    cell: ({ name, error }) => (
      <>
        {name || 'no response'}
        {error && <span class="wrong block small">{error}</span>}
      </>
    ),
  },
  {
    key: 'seen',
    label: 'Last seen',
    value: ({ last_seen_at }) => last_seen_at,
    cell: ({ last_seen_at }) => formatMoment(last_seen_at),
  },
  counted('tasks', 'Tasks'),
  counted('walks', 'Walks'),
  counted('failures', 'Failures'),
  {
    key: 'computed',
    label: 'Computed',
    unit: 's',
    numeric: true,
    value: ({ compute_seconds }) => compute_seconds,
    cell: ({ compute_seconds }) => formatNumber(compute_seconds, 3),
  },
]

function WorkersCard({ workers }: { workers: readonly Worker[] }) {
  return (
    <section class="card" aria-labelledby="workers">
      <h2 id="workers">Workers</h2>
      {workers.length === 0 ? (
        <Empty title="No worker has responded yet" />
      ) : (
        <Table
          caption="Workers of the job"
          rows={workers}
          rowKey={({ name }) => name}
          columns={WORKER_COLUMNS}
        />
      )}
    </section>
  )
}

function LogCard({
  messages,
  level,
  onLevel,
}: {
  messages: Activity['messages']
  level: Level
  onLevel: (level: Level) => void
}) {
  return (
    <section class="card" aria-labelledby="log">
      <header class="row spread">
        <h2 id="log">Log</h2>
        <select
          aria-label="Minimum level"
          value={level}
          onChange={(event) => onLevel(event.currentTarget.value as Level)}
        >
          {LEVELS.map((name) => (
            <option key={name} value={name}>
              {name.toLowerCase()} and above
            </option>
          ))}
        </select>
      </header>
      {messages.length === 0 ? (
        <Empty title="No messages">
          <p>The server keeps a job’s latest messages at or above its log level.</p>
        </Empty>
      ) : (
        // A scrollable box must be reachable by keyboard.
        <section class="log-lines" tabIndex={0} aria-label="Log messages, newest first">
          <ol>
            {[...messages].reverse().map((message, k) => (
              <li key={`${message.at} ${k}`} data-level={message.level}>
                <time dateTime={message.at}>{formatMoment(message.at)}</time>{' '}
                <strong>{message.level.toLowerCase()}</strong> {message.text}
              </li>
            ))}
          </ol>
        </section>
      )}
    </section>
  )
}
