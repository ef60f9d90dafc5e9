/** Start designs: the best of earlier jobs, or those of a cloned job. */

import { get } from '../../api/client'
import { jobSearch } from '../../api/jobs'
import { useResource } from '../../api/resource'
import { Card } from '../../components/card'
import { Combobox } from '../../components/fields/combobox'
import { Problems, TextField } from '../../components/fields/field'
import { RemovableList } from '../../components/fields/removable-list'
import { formatCount, formatNumber } from '../../format/number'
import { errorsUnder } from '../draft/build-spec'
import { NO_START, type StartDraft } from '../draft/settings'
import type { SectionProps } from './settings'

export function StartSection({ draft, errors, onChange }: SectionProps) {
  const { start } = draft
  const problems = errorsUnder(errors, 'start')
  const change = (changes: Partial<StartDraft>) => onChange({ start: { ...start, ...changes } })
  return (
    <Card class="stack-tight" title="Start">
      <RemovableList ids={start.jobs} onChange={(jobs) => change({ jobs })}>
        {(job) => <JobWords id={job} />}
      </RemovableList>
      <div class="fields">
        <Combobox
          label="Best designs of jobs"
          placeholder={start.jobs.length === 0 ? 'none' : 'add another job'}
          hint="Their best designs are evaluated first, as part of the budget."
          invalid={problems.length > 0}
          remote={{
            label: 'Jobs, newest first',
            search: jobSearch('tuning', {
              exclude: start.jobs,
              note: ({ controller }) =>
                controller === draft.controller ? '' : `tunes ${controller}`,
            }),
          }}
          onChoose={(job) => change({ jobs: [...start.jobs, job] })}
        />
        {start.jobs.length > 0 && (
          <TextField
            label="Number of designs"
            inputMode="numeric"
            value={start.count}
            onChange={(count) => change({ count })}
          />
        )}
      </div>
      {start.designs.length > 0 && start.jobs.length === 0 && (
        <p class="row">
          <span>
            The search starts from {formatCount(start.designs.length)} start designs of the cloned
            job.
          </span>
          <button type="button" class="compact" onClick={() => onChange({ start: NO_START })}>
            Remove them
          </button>
        </p>
      )}
      <Problems messages={problems} />
    </Card>
  )
}

/** Name and best fitness of a job; nothing if it is missing, which the estimate reports. */
function JobWords({ id }: { id: string }) {
  const { data } = useResource(id, (signal) =>
    get('/v1/jobs/{job_id}', { path: { job_id: id }, signal }),
  )
  if (data === null) return null
  const fitness = data.best_fitness === null ? '' : `fitness ${formatNumber(data.best_fitness, 4)}`
  return <span class="muted">{[data.name, fitness].filter(Boolean).join(' · ')}</span>
}
