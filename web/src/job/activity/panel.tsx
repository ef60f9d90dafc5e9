/** Activity of a job: timeline of its tasks, workers, and log. */

import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type { Activity, Job } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatMoment } from '../../format/time'
import { sentence } from '../../format/words'
import { oneOf, useQueryValue } from '../../router/query-value'
import { isActive } from '../facts'
import './activity.css'
import { TimelineCard } from './timeline-card'

const POLL_MS = 2000
const LEVELS = ['DEBUG', 'INFO', 'WARNING', 'ERROR'] as const
type Level = (typeof LEVELS)[number]
const LEVEL = oneOf<Level>(LEVELS, 'INFO')

export default function ActivityPanel({ job }: { job: Job }) {
  const [level, setLevel] = useQueryValue('level', LEVEL, 'INFO')
  const activity = useResource(`activity ${job.id} ${level} ${job.state}`, (signal) =>
    get('/v1/jobs/{job_id}/activity', { path: { job_id: job.id }, query: { level }, signal }),
  )
  usePolling(activity.reload, POLL_MS, isActive(job))
  return (
    <Loaded resource={activity} what="the activity">
      {({ reason, workers, messages }) =>
        reason !== null ? (
          <EmptyCard title="No activity recorded">{sentence(reason)}</EmptyCard>
        ) : (
          <div class="stack">
            <TimelineCard activity={activity.data!} />
            <div class="grid">
              <Card title="Workers">
                {workers.length === 0 ? (
                  <Empty title="No worker has responded yet" />
                ) : (
                  <Table caption="Workers of the job" rows={workers} columns={WORKER_COLUMNS} />
                )}
              </Card>
              <Card
                title="Log"
                tools={
                  <Select
                    hidden
                    label="Minimum level"
                    value={level}
                    options={LEVELS.map(
                      (name) => [name, `${name.toLowerCase()} and above`] as const,
                    )}
                    onChoose={setLevel}
                  />
                }
              >
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
              </Card>
            </div>
          </div>
        )
      }
    </Loaded>
  )
}

type Worker = Activity['workers'][number]

const WORKER_COLUMNS: readonly Column<Worker>[] = [
  {
    key: 'machine',
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
    key: 'last seen',
    value: ({ last_seen_at }) => last_seen_at,
    cell: ({ last_seen_at }) => formatMoment(last_seen_at),
  },
  { key: 'tasks', digits: 1, value: ({ tasks }) => tasks },
  { key: 'walks', digits: 1, value: ({ walks }) => walks },
  { key: 'failures', digits: 1, value: ({ failures }) => failures },
  { key: 'computed', unit: 's', digits: 3, value: ({ compute_seconds }) => compute_seconds },
]
