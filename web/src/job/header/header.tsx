/** Name, state, figures and commands of a job. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../../api/client'
import { isReadable } from '../../api/jobs'
import { useNow, useResource, useSlowly } from '../../api/resource'
import type { Job, JobSummary, StoredJob, TuningWorlds } from '../../api/types'
import { Progress, StateBadge } from '../../components/state'
import { useVisible } from '../../components/use-visible'
import {
  change,
  formatCount,
  formatExact,
  formatNumber,
  percent,
  quantity,
} from '../../format/number'
import { formatAge, formatClock, formatDuration, formatMoment } from '../../format/time'
import { lazyPage } from '../../router/lazy-page'
import { jobPath, withQuery } from '../../router/routes'
import { budgetSpent, caseWords, fitnessUnit, startDesigns } from '../facts'
import type { Gain } from '../gain'
import type { LiveJob } from '../live/use-job'
import { JobActions } from './actions'
import { EndNotice } from './end-notice'
import './header.css'
import '../../walk/player/walk-stage.css'

export function JobHeader({ live, job, gain }: { live: LiveJob; job: StoredJob; gain: Gain }) {
  const { followed } = live
  const spent = budgetSpent(job, followed.iterations)
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
          state={job.state}
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
  const { search = null, figure_of_merit: merit = null } = job.best ?? {}
  const started = isReadable(job) ? startDesigns(job).length : 0
  const { reference, share, reason } = gain
  const planned =
    budgetSpent(job).unit === 'iterations'
      ? ` of ${formatCount(job.iterations_planned)}`
      : `, at most ${formatCount(job.particles)} designs each`
  const figures: readonly (readonly [label: string, value: string] | false)[] = [
    [
      search ? 'Best fitness (double precision)' : 'Best fitness',
      quantity(job.best_fitness, unit, search ? 7 : 5),
    ],
    reference !== null && [
      `Gain over ${reference.label}`,
      `${percent(share, 3)}, from ${quantity(reference.fitness, unit, 5)}`,
    ],
    reference === null && reason !== null && job.kind === 'tuning' && ['Gain', `none: ${reason}`],
    search !== null && [
      `Fitness in the search (${search.precision} precision)`,
      `${quantity(search.fitness, unit, 7)} (${change(100 * search.difference, '%', 2)})`,
    ],
    merit !== null && ['Figure of merit F (eq. 3.1)', formatNumber(merit, 5)],
    ['Iterations', formatCount(committed) + planned],
    ['Best in iteration', formatCount(job.best_iteration)],
    ['Evaluations', `${formatCount(job.evaluations)} of ${formatCount(job.evaluations_planned)}`],
    job.evaluations_saved > 0 && [
      'Reused evaluations',
      `${formatCount(job.evaluations_saved)} (${percent(job.evaluations_saved / job.evaluations, 2)})`,
    ],
    started > 0 && ['Start designs', formatCount(started)],
    ['Evaluation rate', quantity(job.evaluations_per_second, '1/s', 3)],
    ['Simulation rate', quantity(job.simulations_per_second, '1/s', 3)],
    !!job.evaluated_on && ['Simulated on', job.evaluated_on],
    ['Time left', timeLeft(job)],
    ['Computing time', formatDuration(job.compute_seconds)],
  ]
  return (
    <dl class="figures">
      {figures
        .filter((figure) => figure !== false)
        .map(([label, value]) => (
          <div key={label}>
            <dt>{label}</dt>
            <dd>{value}</dd>
          </div>
        ))}
    </dl>
  )
}

function timeLeft(job: StoredJob): string {
  if (job.state === 'succeeded') return 'done'
  if (job.state === 'running' && job.eta_seconds === null) return job.eta_basis
  return formatDuration(job.eta_seconds)
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

function WorldsNote({ job }: { job: Job }) {
  const worlds = job.spec.kind === 'tuning' ? job.spec.worlds : null
  if (!worlds) return null
  const { count, seed, ranges } = worlds
  return (
    <p class="small" data-worlds={count}>
      <strong>Robust job</strong>: every design is simulated in {formatCount(count)} world
      {count === 1 ? '' : 's'} with perturbed models
      {ranges && ` (${formatCount(ranges.length)} perturbations)`}, seed {seed}. The utility of a
      scenario is {judgedBy(worlds)}.
    </p>
  )
}

function judgedBy({ aggregate, level = 0.75 }: TuningWorlds): string {
  if (aggregate === 'mean' || aggregate === 'worst') return `the ${aggregate} over all worlds`
  if (aggregate === 'quantile') return `the ${percent(level, 2)} quantile over all worlds`
  const share = formatExact((1 - level) * 100, 3)
  return `the conditional value at risk of its utilities: the mean of the worst ${share} %`
}

/** Most forks shown; the list of jobs has all of them. */
const SHOWN = 12

type Lineage = NonNullable<StoredJob['lineage']>

/** Placed last, so that its late arrival does not move buttons. */
function Forks({ job }: { job: StoredJob }) {
  const forks = useResource(job.id, (signal) =>
    get('/v1/jobs', { query: { parent: job.id, limit: SHOWN + 1 }, signal }).then(
      (page) => page.items,
    ),
  )
  const forkList = forks.data ?? []
  return forkList.length === 0 ? null : (
    <p class="small" data-forks={forkList.length}>
      Forks:{' '}
      {forkList.slice(0, SHOWN).map((fork, index) => (
        <span key={fork.id}>
          {index > 0 && ', '}
          <a href={jobPath(fork.id)}>{fork.id}</a> <span class="muted">{forkWords(fork)}</span>
        </span>
      ))}
      {forkList.length > SHOWN && ' and more'}
    </p>
  )
}

function Parent({ lineage }: { lineage: Lineage }) {
  return (
    <p class="small" data-parent={lineage.parent}>
      Fork of <a href={jobPath(lineage.parent)}>{lineage.parent}</a>
      {lineage.carried === 'search'
        ? `: continues from iteration ${lineage.from_iteration}${changedWords(lineage)}.`
        : `: a new search${changedWords(lineage)} from the best designs before iteration ${
            lineage.from_iteration
          }, because ${lineage.reason}.`}
    </p>
  )
}

/** What differs: " with another preference". */
function changedWords({ changed }: Lineage): string {
  return changed.length > 0 ? ` with another ${changed.join(', ')}` : ''
}

function forkWords({ lineage }: JobSummary): string {
  return lineage ? `from iteration ${lineage.from_iteration}${changedWords(lineage)}` : ''
}

const BestWalk = lazyPage('the walk', () => import('./best-walk'))

const REST_MS = 1200
const RENEW_MS = 30_000

function WalkPreview({ job }: { job: Job }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [active, setActive] = useState(false)
  const best = useSlowly(job.best_iteration ?? 0, RENEW_MS)
  useEffect(() => {
    if (active || !visible || matchMedia('(prefers-reduced-motion: reduce)').matches) return
    const timer = setTimeout(() => setActive(true), REST_MS)
    return () => clearTimeout(timer)
  }, [visible, active])
  return (
    <div class="walk-preview" ref={box} data-loaded={active}>
      {active ? (
        <BestWalk job={job} best={best} visible={visible} />
      ) : (
        <div class="walk-preview-stage">
          <button type="button" onClick={() => setActive(true)}>
            Show the replay
          </button>
        </div>
      )}
      <a class="small" href={withQuery('/walk', { job: job.id })}>
        Full replay with plots
      </a>
    </div>
  )
}
