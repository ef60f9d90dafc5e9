/** Figures of a job, its relatives, and the spread of its search. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, JobSummary, StoredJob, TuningWorlds } from '../../api/types'
import { Card } from '../../components/card'
import {
  change,
  formatCount,
  formatExact,
  formatNumber,
  percent,
  quantity,
} from '../../format/number'
import { formatDuration, formatMoment } from '../../format/time'
import { jobPath } from '../../router/routes'
import { IterationChart } from '../by-iteration'
import { fitnessUnit, startDesigns } from '../facts'
import type { Gain } from '../gain'
import type { PanelProps } from '../page'
import { useDistribution } from '../result/use-distribution'

export default function SummaryPanel({ live, job, gain }: PanelProps) {
  const { items } = useDistribution(job.id, live.followed.iterations.length)
  return (
    <div class="stack">
      <Card title="Summary">
        <div class="stack">
          <Figures job={job} gain={gain} />
          {job.note && <p class="job-note">{job.note}</p>}
          <WorldsNote job={job} />
          {job.lineage && <Parent lineage={job.lineage} />}
          <Forks job={job} />
        </div>
      </Card>
      {items.length > 0 && (
        <IterationChart
          title="Diversity of the designs"
          note={
            items.some(({ diversity }) => diversity !== null)
              ? 'Spread of the designs as a share of each variable’s range; near zero, the search has converged.'
              : 'The method evaluates one design at a time, which has no spread.'
          }
          label={`Diversity of the designs, now ${percent(items.at(-1)?.diversity)} of the range`}
          rows={items}
          name="diversity"
          yUnit="%"
          format={(value) => formatNumber(value, 3)}
          value={({ diversity }) => diversity && diversity * 100}
          colour="--series-3"
          zoomName="zoom-diversity"
          fromZero
        />
      )}
    </div>
  )
}

function Figures({ job, gain }: { job: Job; gain: Gain }) {
  const unit = fitnessUnit(job)
  const { search = null, figure_of_merit: merit = null } = job.best ?? {}
  const started = startDesigns(job).length
  const { reference, share, reason } = gain
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
    ['Evaluations', `${formatCount(job.evaluations)} of ${formatCount(job.evaluations_planned)}`],
    [
      'Iterations',
      `${formatCount(job.iterations)}, at most ${formatCount(job.particles)} designs each`,
    ],
    ['Best in iteration', formatCount(job.best_iteration)],
    job.evaluations_saved > 0 && [
      'Reused evaluations',
      `${formatCount(job.evaluations_saved)} (${percent(job.evaluations_saved / job.evaluations, 2)})`,
    ],
    started > 0 && ['Start designs', formatCount(started)],
    ['Evaluation rate', quantity(job.evaluations_per_second, '1/s', 3)],
    ['Simulation rate', quantity(job.simulations_per_second, '1/s', 3)],
    !!job.evaluated_on && ['Simulated on', job.evaluated_on],
    ['Computing time', formatDuration(job.compute_seconds)],
    ['Submitted', formatMoment(job.created_at)],
    ['Seed', String(job.spec.seed)],
    ['Precision', job.spec.precision],
    ['Priority', String(job.priority)],
    ...(job.robot ? [['Robot', job.robot === 'own' ? 'custom' : job.robot] as const] : []),
    ...(job.preference ? [['Preference', job.preference] as const] : []),
    ['Id', job.id],
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
