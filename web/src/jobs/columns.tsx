/** Columns of the job list. */

import type { JobSummary } from '../api/types'
import { Progress, StateBadge } from '../components/state'
import type { Column } from '../components/table/table'
import { NONE, percent, quantity } from '../format/number'
import { formatAge, formatDuration, formatMoment } from '../format/time'
import { budgetSpent, fitnessUnit, spentInWords } from '../job/facts'
import { referenceLabel } from '../job/gain'
import { jobPath } from '../router/routes'
import { Sparkline, type Sparklines } from './sparkline'

interface Listed {
  readonly lines: Sparklines
  readonly selected: readonly string[]
  readonly onSelect: (ids: readonly string[]) => void
  readonly jobs: readonly JobSummary[]
}

/** Columns sorted by the server. now: [ms], for ages. */
export function jobColumns(
  now: number,
  { lines, selected, onSelect, jobs }: Listed,
): readonly Column<JobSummary>[] {
  const chosen = new Set(selected)
  const all = jobs.every(({ id }) => chosen.has(id))
  const others = selected.filter((id) => !jobs.some((job) => job.id === id))
  return [
    {
      key: 'select',
      heading: (
        <input
          type="checkbox"
          aria-label="Select the jobs of this page"
          checked={all}
          onChange={() => onSelect(all ? others : [...others, ...jobs.map(({ id }) => id)])}
        />
      ),
      cell: ({ id, name }) => (
        <input
          type="checkbox"
          aria-label={`Select ${name || id}`}
          checked={chosen.has(id)}
          onChange={() =>
            onSelect(chosen.has(id) ? selected.filter((each) => each !== id) : [...selected, id])
          }
        />
      ),
    },
    { key: 'name', sortable: true, header: true, cell: (job) => <NameCell job={job} /> },
    { key: 'state', sortable: true, cell: ({ state }) => <StateBadge state={state} /> },
    { key: 'priority', sortable: true, numeric: true, minor: true, cell: (job) => job.priority },
    { key: 'evaluations', sortable: true, cell: (job) => <ProgressCell job={job} /> },
    {
      key: 'fitness',
      label: 'Best fitness',
      sortable: true,
      numeric: true,
      cell: (job) => quantity(job.best_fitness, fitnessUnit(job), 5),
    },
    {
      key: 'gain',
      sortable: true,
      numeric: true,
      cell: ({ gain, reference }) =>
        typeof gain === 'number' && reference ? (
          <span title={`over ${referenceLabel(reference)}`}>{percent(gain, 3)}</span>
        ) : (
          NONE
        ),
    },
    { key: 'convergence', minor: true, cell: ({ id }) => <Sparkline line={lines.get(id)} /> },
    {
      key: 'rate',
      label: 'Evaluations',
      sortable: true,
      unit: '1/s',
      digits: 3,
      minor: true,
      value: (job) => job.evaluations_per_second,
    },
    {
      key: 'time_left',
      label: 'Time left',
      sortable: true,
      numeric: true,
      minor: true,
      cell: (job) => (job.state === 'succeeded' ? NONE : formatDuration(job.eta_seconds)),
    },
    {
      key: 'created',
      label: 'Age',
      sortable: true,
      numeric: true,
      minor: true,
      cell: ({ created_at }) => (
        <time dateTime={created_at} title={`submitted ${formatMoment(created_at)}`}>
          {formatAge(created_at, now)}
        </time>
      ),
    },
  ]
}

function NameCell({ job }: { job: JobSummary }) {
  const { id, name, kind, controller, lineage, tags = [], note, error } = job
  const details = [name && id, kind !== 'tuning' && kind, controller].filter(Boolean)
  return (
    <div class="job-name">
      <a href={jobPath(id)}>{name || id}</a>
      <span class="muted small">{details.join(' · ')}</span>
      {lineage && (
        <span class="muted small">
          fork of <a href={jobPath(lineage.parent)}>{lineage.parent}</a>
        </span>
      )}
      {tags.length > 0 && (
        <span class="small">
          {tags.map((tag) => (
            <span key={tag} class="tag">
              {tag}
            </span>
          ))}
        </span>
      )}
      {note && <span class="muted small note">{note}</span>}
      {error && <span class="wrong">{error}</span>}
    </div>
  )
}

function ProgressCell({ job }: { job: JobSummary }) {
  const spent = budgetSpent(job)
  const text = spentInWords(spent)
  return (
    <div class="job-progress">
      <span>{text}</span>
      <Progress {...spent} label={text} state={job.state} />
    </div>
  )
}
