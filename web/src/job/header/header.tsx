/** A job's name, state, figures and commands. */

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
  const marks = [
    ...(job.kept ? ['kept'] : []),
    ...(job.archived ? ['archived'] : []),
    ...(job.tags ?? []),
  ]
  return (
    <section class="card job-header" aria-label="The job">
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
            {(marks.length > 0 || job.note) && (
              <p class="small" data-labels>
                {marks.join(' · ')}
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
            <strong>It waits, and goes on by itself.</strong>
            <p>{job.waiting}</p>
          </div>
        )}
        {job.error && (
          <div class="notice" data-tone="bad" role="alert" data-error>
            <strong>{isReadable(job) ? 'It failed.' : 'It cannot be read.'}</strong>
            <p>{job.error}</p>
            {isReadable(job) && (
              <p class="small">
                What was committed before is kept. Resume tries the iteration again; clone lets you
                change the job.
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
        label={search ? 'Best fitness, in double' : 'Best fitness'}
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
          label={`Its fitness in the search, in ${search.precision}`}
          value={`${quantity(search.fitness, unit, 7)} (${change(100 * search.difference, '%', 2)})`}
        />
      )}
      {merit !== null && <Figure label="F of eq. 3.1, maximized" value={formatNumber(merit, 5)} />}
      <Figure
        label="Iterations"
        value={
          budgetSpent(job).unit === 'iterations'
            ? `${formatCount(committed)} of ${formatCount(job.iterations_planned)}`
            : `${formatCount(committed)}, of ${formatCount(job.particles)} designs at most`
        }
      />
      <Figure
        label="Found in iteration"
        value={job.best_iteration === null ? '–' : formatCount(job.best_iteration)}
      />
      <Figure
        label="Evaluations"
        value={`${formatCount(job.evaluations)} of ${formatCount(job.evaluations_planned)}`}
      />
      {job.evaluations_saved > 0 && (
        <Figure
          label="Known without a walk"
          value={`${formatCount(job.evaluations_saved)} (${percent(job.evaluations_saved / job.evaluations, 2)})`}
        />
      )}
      {started > 0 && (
        <Figure
          label="Began with"
          value={`${formatCount(started)} known design${started === 1 ? '' : 's'}`}
        />
      )}
      <Figure label="Evaluation rate" value={quantity(job.evaluations_per_second, '1/s', 3)} />
      <Figure label="Walk rate" value={quantity(job.simulations_per_second, '1/s', 3)} />
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

/** Whether what is shown is what is. */
function StreamNote({ live }: { live: LiveJob }) {
  const { connection, staleSince } = live.followed
  if (connection === 'stale' && staleSince !== null) {
    return (
      <span class="badge" data-tone="warn" role="status">
        data is stale since {formatClock(staleSince)}; reconnecting
      </span>
    )
  }
  if (connection === 'open') return <span class="muted small">live</span>
  return null
}

/** What it is, and since when. */
function Subtitle({ job }: { job: StoredJob }) {
  const now = useNow(1000)
  const words = caseWords(job.kind ?? 'tuning')
  const asked = isReadable(job)
    ? [
        job.controller ?? job.kind,
        ...(job.robot ? [job.robot === 'own' ? 'a robot of its own' : job.robot] : []),
        `${formatCount(job.scenarios.length)} ${job.scenarios.length === 1 ? words.one : words.many}`,
        ...(job.preference ? [`preference ${job.preference}`] : []),
        job.optimizer,
        `${formatCount(job.particles)} designs an iteration`,
        `seed ${job.spec.seed}`,
        `${job.precision} precision`,
      ]
    : []
  const priority = job.priority === 0 ? [] : [`priority ${job.priority}`]
  const submitted = `submitted ${formatMoment(job.created_at)}, ${formatAge(job.created_at, now)} ago`
  return <p class="muted small">{[job.id, ...asked, ...priority, submitted].join(' · ')}</p>
}
