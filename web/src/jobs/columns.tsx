/** Columns of the list of jobs. */

import type { JobSummary } from '../api/types'
import { Progress } from '../components/progress'
import { STATE_TONES, StateBadge } from '../components/state-badge'
import type { Column } from '../components/table'
import { formatNumber, quantity } from '../format/number'
import { formatAge, formatDuration, formatMoment } from '../format/time'
import { budgetSpent, spentInWords } from '../job/budget'
import { fitnessUnit } from '../job/fitness'
import { jobPath } from '../router/routes'

/** now: [ms], for ages. */
export function jobColumns(now: number): readonly Column<JobSummary>[] {
  return [
    {
      key: 'name',
      label: 'Name',
      header: true,
      value: (job) => job.name || job.id,
      cell: (job) => <NameCell job={job} />,
    },
    {
      key: 'state',
      label: 'State',
      value: (job) => job.state,
      cell: (job) => <StateBadge state={job.state} />,
    },
    {
      key: 'priority',
      label: 'Priority',
      numeric: true,
      minor: true,
      value: (job) => job.priority,
      cell: (job) => String(job.priority),
    },
    {
      key: 'progress',
      label: 'Iterations',
      value: (job) => job.evaluations / job.evaluations_planned,
      cell: (job) => <ProgressCell job={job} />,
    },
    {
      key: 'best',
      label: 'Best fitness',
      numeric: true,
      value: (job) => job.best_fitness,
      cell: (job) => quantity(job.best_fitness, fitnessUnit(job), 5),
    },
    {
      key: 'rate',
      label: 'Evaluations',
      unit: '1/s',
      numeric: true,
      minor: true,
      value: (job) => job.evaluations_per_second,
      cell: (job) => formatNumber(job.evaluations_per_second, 3),
    },
    {
      key: 'eta',
      label: 'Time left',
      numeric: true,
      minor: true,
      value: (job) => (job.state === 'succeeded' ? null : job.eta_seconds),
      cell: (job) => (job.state === 'succeeded' ? '–' : formatDuration(job.eta_seconds)),
    },
    {
      key: 'age',
      label: 'Age',
      numeric: true,
      minor: true,
      value: (job) => -Date.parse(job.created_at),
      cell: (job) => (
        <time dateTime={job.created_at} title={`submitted ${formatMoment(job.created_at)}`}>
          {formatAge(job.created_at, now)}
        </time>
      ),
    },
  ]
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
