/** Name, state, progress and commands of a job. */

import { isReadable } from '../../api/jobs'
import { useNow } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { Progress, StateBadge } from '../../components/state'
import { formatCount } from '../../format/number'
import { formatAge, formatClock, formatDuration } from '../../format/time'
import { budgetSpent, caseWords, hasEnded, isActive, spentInWords } from '../facts'
import type { LiveJob } from '../live/use-job'
import { useOutcome } from '../outcome'
import { JobActions } from './actions'
import { EndNotice } from './end-notice'
import './header.css'

export function JobHeader({ live, job }: { live: LiveJob; job: StoredJob }) {
  const spent = budgetSpent(job, live.followed.iterations)
  const outcome = useOutcome(job)
  return (
    <>
      <section class="job-header" aria-label="Job summary">
        <div class="job-title">
          <div class="row">
            <h1>{job.name || job.id}</h1>
            <span role="status">
              <StateBadge state={job.state} outcome={outcome} />
            </span>
            <StreamNote live={live} />
          </div>
          <Facts job={job} iterations={live.followed.iterations.length} spent={spent} />
        </div>
        <JobActions job={job} onJob={live.replace} onDeleting={live.hold} />
        {!hasEnded(job) && <Progress {...spent} label={spentInWords(spent)} state={job.state} />}
      </section>
      {job.waiting && (
        <div class="notice" data-tone="warn" role="status" data-waiting>
          <strong>Waiting; the job will continue automatically.</strong>
          <p>{job.waiting}</p>
        </div>
      )}
      {job.error && (
        <div class="notice" data-tone="bad" role="alert" data-error>
          <strong>{isReadable(job) ? 'The job failed.' : 'The job cannot be read.'}</strong>
          <p>{job.error}</p>
          {isReadable(job) && (
            <p class="small">
              Committed evaluations are kept. Resume retries the failed iteration; clone creates a
              new job that you can change.
            </p>
          )}
        </div>
      )}
    </>
  )
}

function Facts({
  job,
  iterations,
  spent,
}: {
  job: StoredJob
  iterations: number
  spent: ReturnType<typeof budgetSpent>
}) {
  const now = useNow(1000)
  const committed = Math.max(job.iterations, iterations)
  const words = caseWords(job.kind ?? 'tuning')
  const cases = job.scenarios?.length ?? 0
  const done = hasEnded(job)
    ? `${formatCount(spent.done)} evaluations in ${formatCount(committed)} iterations`
    : spentInWords(spent)
  const facts = [
    done,
    isActive(job) ? timeLeft(job) : formatDuration(job.compute_seconds),
    ...(isReadable(job)
      ? [
          job.controller ?? job.kind,
          `${formatCount(cases)} ${cases === 1 ? words.item : words.items}`,
          job.optimizer,
          ...(job.spec.kind === 'tuning' && job.spec.worlds
            ? [`${formatCount(job.spec.worlds.count)} worlds each`]
            : []),
        ]
      : []),
    ...(job.priority === 0 ? [] : [`priority ${job.priority}`]),
    `${formatAge(job.created_at, now)} ago`,
  ]
  const labels = [
    ...(job.kept ? ['kept'] : []),
    ...(job.archived ? ['archived'] : []),
    ...(job.tags ?? []),
  ]
  return (
    <p class="muted small row">
      <span>{facts.join(' · ')}</span>
      {labels.length > 0 && <strong data-labels>{labels.join(' · ')}</strong>}
      <EndNotice job={job} />
    </p>
  )
}

export function timeLeft(job: StoredJob): string {
  if (job.state === 'running' && job.eta_seconds === null) return job.eta_basis
  return job.eta_seconds === null ? 'waiting' : `${formatDuration(job.eta_seconds)} left`
}

function StreamNote({ live }: { live: LiveJob }) {
  const { connection, staleSince } = live.followed
  if (connection === 'stale' && staleSince !== null) {
    return (
      <span class="badge" data-tone="warn" role="status">
        stale since {formatClock(staleSince)}; reconnecting
      </span>
    )
  }
  if (connection === 'open') return <span class="muted small">live</span>
  return null
}
