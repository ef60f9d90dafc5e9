/** Name, state, figures and commands of a job. */

import { isReadable } from '../../api/readable'
import { useNow } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { Progress } from '../../components/progress'
import { STATE_TONES, StateBadge } from '../../components/state-badge'
import { change, formatCount, formatNumber, percent, quantity } from '../../format/number'
import { formatAge, formatClock, formatDuration, formatMoment } from '../../format/time'
import { budgetSpent } from '../budget'
import { caseWords, fitnessUnit } from '../fitness'
import type { Gain } from '../gain'
import type { LiveJob } from '../live/use-job'
import { startDesigns } from '../start'
import { JobActions } from './actions'
import { EndNotice } from './end-notice'
import { Forks, Parent } from './lineage'
import { WalkPreview } from './walk-preview'
import { WorldsNote } from './worlds-note'
import './header.css'

export function JobHeader({ live, job, gain }: { live: LiveJob; job: StoredJob; gain: Gain }) {
  const { followed } = live
  const spent = budgetSpent(job, followed.iterations)
  const tone = STATE_TONES[job.state]
  const labels = [
    ...(job.kept ? ['kept'] : []),
    ...(job.archived ? ['archived'] : []),
    ...(job.tags ?? []),
  ]
  return (
    <section class="card job-header" aria-label="Job summary">
      <div class="job-summary">
        <div class="page-header">
          <div>
            <div class="row">
              <h1>{job.name || job.id}</h1>
              <span role="status">
                <StateBadge state={job.state} />
              </span>
              <StreamNote live={live} />
              <EndNotice job={job} />
            </div>
            <Subtitle job={job} />
            {(labels.length > 0 || job.note) && (
              <p class="small" data-labels>
                {labels.join(' · ')}
                {job.note && <span class="job-note">{job.note}</span>}
              </p>
            )}
            {isReadable(job) && <WorldsNote job={job} />}
            {job.lineage && <Parent lineage={job.lineage} />}
          </div>
          <JobActions job={job} onJob={live.replace} onDeleting={live.hold} />
        </div>
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
                Committed iterations are kept. Resume retries the failed iteration; clone creates a
                new job that you can change.
              </p>
            )}
          </div>
        )}
        <Progress
          done={spent.done}
          planned={spent.planned}
          label={`${spent.done} of ${spent.planned} ${spent.unit}`}
          tone={tone === 'good' || tone === 'bad' ? tone : 'accent'}
        />
        <Figures
          job={job}
          gain={gain}
          committed={Math.max(job.iterations, followed.iterations.length)}
        />
        <Forks job={job} />
      </div>
      {isReadable(job) && job.kind === 'tuning' && job.best && <WalkPreview job={job} />}
    </section>
  )
}

function Figures({ job, gain, committed }: { job: StoredJob; gain: Gain; committed: number }) {
  const unit = fitnessUnit(job)
  const merit = job.best?.figure_of_merit ?? null
  const search = job.best?.search ?? null
  const started = isReadable(job) ? startDesigns(job).length : 0
  return (
    <dl class="figures">
      <Figure
        label={search ? 'Best fitness (double precision)' : 'Best fitness'}
        value={quantity(job.best_fitness, unit, search ? 7 : 5)}
      />
      {gain.reference && (
        <Figure
          label={`Gain over ${gain.reference.label}`}
          value={`${percent(gain.share, 3)}, from ${quantity(gain.reference.fitness, unit, 5)}`}
        />
      )}
      {gain.reference === null && gain.reason !== null && job.kind === 'tuning' && (
        <Figure label="Gain" value={`none: ${gain.reason}`} />
      )}
      {search && (
        <Figure
          label={`Fitness in the search (${search.precision} precision)`}
          value={`${quantity(search.fitness, unit, 7)} (${change(100 * search.difference, '%', 2)})`}
        />
      )}
      {merit !== null && (
        <Figure label="Figure of merit F (eq. 3.1)" value={formatNumber(merit, 5)} />
      )}
      <Figure
        label="Iterations"
        value={
          budgetSpent(job).unit === 'iterations'
            ? `${formatCount(committed)} of ${formatCount(job.iterations_planned)}`
            : `${formatCount(committed)}, at most ${formatCount(job.particles)} designs each`
        }
      />
      <Figure
        label="Best in iteration"
        value={job.best_iteration === null ? '–' : formatCount(job.best_iteration)}
      />
      <Figure
        label="Evaluations"
        value={`${formatCount(job.evaluations)} of ${formatCount(job.evaluations_planned)}`}
      />
      {job.evaluations_saved > 0 && (
        <Figure
          label="Reused evaluations"
          value={`${formatCount(job.evaluations_saved)} (${percent(job.evaluations_saved / job.evaluations, 2)})`}
        />
      )}
      {started > 0 && <Figure label="Start designs" value={formatCount(started)} />}
      <Figure label="Evaluation rate" value={quantity(job.evaluations_per_second, '1/s', 3)} />
      <Figure label="Simulation rate" value={quantity(job.simulations_per_second, '1/s', 3)} />
      <Figure label="Time left" value={timeLeft(job)} />
      <Figure label="Computing time" value={formatDuration(job.compute_seconds)} />
    </dl>
  )
}

function timeLeft(job: StoredJob): string {
  if (job.state === 'succeeded') return 'done'
  if (job.state === 'running' && job.eta_seconds === null) return job.eta_basis
  return formatDuration(job.eta_seconds)
}

function Figure({ label, value }: { label: string; value: string }) {
  return (
    <div>
      <dt>{label}</dt>
      <dd>{value}</dd>
    </div>
  )
}

/** Connection status of the live data. */
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

/** Key settings, and the time of submission. */
function Subtitle({ job }: { job: StoredJob }) {
  const now = useNow(1000)
  const words = caseWords(job.kind ?? 'tuning')
  const settings = isReadable(job)
    ? [
        job.controller ?? job.kind,
        ...(job.robot ? [job.robot === 'own' ? 'custom robot' : job.robot] : []),
        `${formatCount(job.scenarios.length)} ${job.scenarios.length === 1 ? words.item : words.items}`,
        ...(job.preference ? [`preference ${job.preference}`] : []),
        job.optimizer,
        `${formatCount(job.particles)} designs per iteration`,
        `seed ${job.spec.seed}`,
        `${job.precision} precision`,
      ]
    : []
  const priority = job.priority === 0 ? [] : [`priority ${job.priority}`]
  const submitted = `submitted ${formatMoment(job.created_at)}, ${formatAge(job.created_at, now)} ago`
  return <p class="muted small">{[job.id, ...settings, ...priority, submitted].join(' · ')}</p>
}
