/** Columns of the job list. */

import type { JobSummary } from '../api/types'
import { Progress } from '../components/progress'
import { STATE_TONES, StateBadge } from '../components/state-badge'
import type { Column } from '../components/table/table'
import { formatNumber, percent, quantity } from '../format/number'
import { formatAge, formatDuration, formatMoment } from '../format/time'
import { budgetSpent, spentInWords } from '../job/budget'
import { fitnessUnit } from '../job/fitness'
import { referenceLabel } from '../job/gain'
import { jobPath } from '../router/routes'
import { Sparkline, type Sparklines } from './sparkline'

/** Data shared by all rows. */
interface Shared {
  readonly lines: Sparklines
  /** Ids of the selected jobs. */
  readonly chosen: readonly string[]
  readonly onChoose: (id: string, on: boolean) => void
}

/** Columns sorted by the server. now: [ms], for ages. */
export function jobColumns(
  now: number,
  { lines, chosen, onChoose }: Shared,
): readonly Column<JobSummary>[] {
  return [
    {
      key: 'choose',
      label: 'Select',
      cell: (job) => (
        <input
          type="checkbox"
          aria-label={`Select ${job.name || job.id}`}
          checked={chosen.includes(job.id)}
          onChange={(event) => onChoose(job.id, event.currentTarget.checked)}
        />
      ),
    },
    {
      key: 'name',
      label: 'Name',
      sortable: true,
      header: true,
      cell: (job) => <NameCell job={job} />,
    },
    {
      key: 'state',
      label: 'State',
      sortable: true,
      cell: (job) => <StateBadge state={job.state} />,
    },
    {
      key: 'priority',
      label: 'Priority',
      sortable: true,
      numeric: true,
      minor: true,
      cell: (job) => String(job.priority),
    },
    {
      key: 'iterations',
      label: 'Iterations',
      sortable: true,
      cell: (job) => <ProgressCell job={job} />,
    },
    {
      key: 'fitness',
      label: 'Best fitness',
      sortable: true,
      numeric: true,
      cell: (job) => quantity(job.best_fitness, fitnessUnit(job), 5),
    },
    {
      key: 'gain',
      label: 'Gain',
      sortable: true,
      numeric: true,
      cell: (job) => <GainCell job={job} />,
    },
    {
      key: 'line',
      label: 'Convergence',
      minor: true,
      cell: (job) => <Sparkline line={lines.get(job.id)} />,
    },
    {
      key: 'rate',
      label: 'Evaluations',
      sortable: true,
      unit: '1/s',
      numeric: true,
      minor: true,
      cell: (job) => formatNumber(job.evaluations_per_second, 3),
    },
    {
      key: 'time_left',
      label: 'Time left',
      sortable: true,
      numeric: true,
      minor: true,
      cell: (job) => (job.state === 'succeeded' ? '–' : formatDuration(job.eta_seconds)),
    },
    {
      key: 'created',
      label: 'Age',
      sortable: true,
      numeric: true,
      minor: true,
      cell: (job) => (
        <time dateTime={job.created_at} title={`submitted ${formatMoment(job.created_at)}`}>
          {formatAge(job.created_at, now)}
        </time>
      ),
    },
  ]
}

function GainCell({ job }: { job: JobSummary }) {
  if (typeof job.gain !== 'number' || !job.reference) return '–'
  return <span title={`over ${referenceLabel(job.reference)}`}>{percent(job.gain, 3)}</span>
}

function NameCell({ job }: { job: JobSummary }) {
  const what = [job.kind === 'tuning' ? null : job.kind, job.controller]
  const details = [job.name ? job.id : null, ...what].filter((part) => part)
  return (
    <div class="job-name">
      <a href={jobPath(job.id)}>{job.name || job.id}</a>
      <span class="muted small">{details.join(' · ')}</span>
      {job.lineage && (
        <span class="muted small">
          fork of <a href={jobPath(job.lineage.parent)}>{job.lineage.parent}</a>
        </span>
      )}
      {(job.tags ?? []).length > 0 && (
        <span class="small">
          {(job.tags ?? []).map((tag) => (
            <span key={tag} class="tag">
              {tag}
            </span>
          ))}
        </span>
      )}
      {job.note && <span class="muted small note">{job.note}</span>}
      {job.error && <span class="wrong">{job.error}</span>}
    </div>
  )
}

function ProgressCell({ job }: { job: JobSummary }) {
  const tone = STATE_TONES[job.state]
  const spent = budgetSpent(job)
  const text = spentInWords(spent)
  return (
    <div class="job-progress">
      <span>{spent.unit === 'iterations' ? text : `${text} ${spent.unit}`}</span>
      <Progress
        done={spent.done}
        planned={spent.planned}
        label={`${text} ${spent.unit}`}
        tone={tone === 'good' || tone === 'bad' ? tone : 'accent'}
      />
    </div>
  )
}
