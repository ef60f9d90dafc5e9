/** Activity of a job: timeline of its tasks, workers, and log. */

import { useMemo } from 'preact/hooks'
import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type { Activity, Job } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatNumber } from '../../format/number'
import { formatMoment } from '../../format/time'
import { sentence } from '../../format/words'
import { oneOf, useQueryValue } from '../../router/query-value'
import { isActive } from '../facts'
import { type Bar, type Lane, type Timeline, timelineOf } from './timeline'
import './activity.css'

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

const MOST = 300

const LEGEND = [
  ['task-computed', 'computing'],
  ['task-waiting', 'in transit or waiting'],
  ['task-failed', 'failed'],
]

/** Width of a lane's coordinate system, stretched to its box. */
const WIDTH = 1000

function TimelineCard({ activity }: { activity: Activity }) {
  const timeline = useMemo(() => timelineOf(activity, MOST), [activity])
  const drawn = Math.min(MOST, activity.tasks.length)
  return (
    <ChartCard
      title="Timeline"
      note={`The last ${formatCount(drawn)} tasks over ${formatNumber(timeline.seconds, 3)} s by machine; lines mark the starts of iterations.`}
      legend={LEGEND.map(([name, label]) => (
        <span key={name}>
          <i class={`swatch ${name}`} aria-hidden="true" />
          {label}
        </span>
      ))}
      table={() => (
        <Table
          caption="Tasks, newest first"
          rows={[...activity.tasks].reverse()}
          columns={COLUMNS}
        />
      )}
    >
      {drawn === 0 ? (
        <Empty title="No task has finished yet" />
      ) : (
        <div class="timeline" role="img" aria-label={inWords(timeline)}>
          {timeline.workers.map(({ worker, lanes }) => (
            <div class="timeline-worker" key={worker} data-worker={worker}>
              <span class="small">{worker || 'no response'}</span>
              <div>
                {lanes.map((lane, k) => (
                  <LaneRow key={k} lane={lane} timeline={timeline} />
                ))}
              </div>
            </div>
          ))}
        </div>
      )}
    </ChartCard>
  )
}

function LaneRow({ lane, timeline }: { lane: Lane; timeline: Timeline }) {
  const x = (seconds: number) => (seconds / timeline.seconds) * WIDTH
  return (
    <svg viewBox={`0 0 ${WIDTH} 10`} preserveAspectRatio="none" aria-hidden="true">
      {lane.map((bar, k) => (
        <TaskBar key={k} bar={bar} x={x} />
      ))}
      {timeline.iterations.map(({ iteration, start: begun }) => (
        <line key={iteration} x1={x(begun)} x2={x(begun)} y1={0} y2={10} />
      ))}
    </svg>
  )
}

function TaskBar({ bar, x }: { bar: Bar; x: (seconds: number) => number }) {
  const [left, width] = [x(bar.start), Math.max(1, x(bar.end - bar.start))]
  const box = { y: 1, height: 8 }
  if (bar.task.error !== null) return <rect class="task-failed" x={left} width={width} {...box} />
  const computed = width * bar.computed
  return (
    <>
      <rect class="task-waiting" x={left} width={width} {...box} />
      <rect class="task-computed" x={left + width - computed} width={computed} {...box} />
    </>
  )
}

function inWords({ workers, seconds }: Timeline): string {
  const each = workers.map(({ worker, lanes }) => {
    const tasks = lanes.reduce((sum, lane) => sum + lane.length, 0)
    return `${worker || 'no response'}: ${tasks} tasks, at most ${lanes.length} at once`
  })
  return `Timeline of ${formatNumber(seconds, 3)} s. ${each.join('; ')}`
}

type Task = Activity['tasks'][number]

const COLUMNS: readonly Column<Task>[] = [
  {
    key: 'started',
    header: true,
    value: (task) => task.begun_at,
    cell: (task) => formatMoment(task.begun_at),
  },
  { key: 'iteration', numeric: true, value: (task) => task.iteration },
  { key: 'machine', value: (task) => task.worker || 'no response' },
  { key: 'walks', numeric: true, value: (task) => task.walks },
  { key: 'time', unit: 's', digits: 3, value: (task) => task.seconds },
  { key: 'computed', unit: 's', digits: 3, value: (task) => task.compute_seconds },
  { key: 'error', value: (task) => task.error ?? '' },
]
