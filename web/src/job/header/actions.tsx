/** Pause, resume, extend, fork, keep, cancel, delete and clone, as far as the job's state allows. */

import { useState } from 'preact/hooks'
import { get, post, put, remove } from '../../api/client'
import { isReadable } from '../../api/readable'
import type { StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { ErrorNotice } from '../../components/feedback'
import { formatCount } from '../../format/number'
import { navigate } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { budgetSpent, iterationsSpent, spentInWords } from '../budget'
import { canFork, ForkButton } from './fork-dialog'
import { LabelDialog } from './label-dialog'
import { PriorityDialog } from './priority-dialog'

type Asking = 'cancel' | 'delete' | 'extend' | 'label' | 'priority' | null

interface Props {
  readonly job: StoredJob
  readonly onJob: (job: StoredJob) => void
  /** A deletion begins, or did not come about; the page asks nothing of the job meanwhile. */
  readonly onDeleting: (deleting: boolean) => void
}

export function JobActions({ job, onJob, onDeleting }: Props) {
  const [asking, setAsking] = useState<Asking>(null)
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const command = (send: () => Promise<StoredJob>) => {
    setBusy(true)
    setError(null)
    setAsking(null)
    send()
      .then(onJob, setError)
      .finally(() => setBusy(false))
  }
  const path = { job_id: job.id }
  const can = (name: string) => name in job.links
  return (
    <div class="stack-tight actions">
      <div class="row">
        {can('pause') && (
          <button
            type="button"
            disabled={busy}
            onClick={() => command(() => post('/v1/jobs/{job_id}/pause', { path }))}
          >
            Pause
          </button>
        )}
        {can('resume') && (
          <button
            type="button"
            class="primary"
            disabled={busy}
            onClick={() => command(() => post('/v1/jobs/{job_id}/resume', { path }))}
          >
            Resume
          </button>
        )}
        {can('extend') && (
          <button type="button" disabled={busy} onClick={() => setAsking('extend')}>
            Extend…
          </button>
        )}
        {can('priority') && (
          <button type="button" disabled={busy} onClick={() => setAsking('priority')}>
            Priority…
          </button>
        )}
        <button type="button" disabled={busy} onClick={() => setAsking('label')}>
          Label…
        </button>
        <button
          type="button"
          disabled={busy}
          title={job.kept ? 'so that it can be deleted' : 'so that it cannot be deleted'}
          onClick={() => command(() => (job.kept ? released(job.id) : kept(job.id)))}
        >
          {job.kept ? 'Release' : 'Keep'}
        </button>
        {canFork(job, job.iterations) && <ForkButton job={job} from={job.iterations} />}
        {isReadable(job) && (
          <a class="button" href={withQuery('/jobs/new', { clone: job.id })}>
            Clone
          </a>
        )}
        {isReadable(job) && job.kind === 'tuning' && job.best_fitness !== null && (
          <a class="button" href={withQuery('/jobs/new', { clone: job.id, start: job.id })}>
            Start from its best
          </a>
        )}
        {can('cancel') && (
          <button type="button" class="danger" disabled={busy} onClick={() => setAsking('cancel')}>
            Cancel…
          </button>
        )}
        {can('delete') && (
          <button type="button" class="danger" disabled={busy} onClick={() => setAsking('delete')}>
            Delete…
          </button>
        )}
      </div>
      {error !== null && <ErrorNotice what="That was not done." error={error} />}
      <ConfirmDialog
        open={asking === 'cancel'}
        title="Cancel this job for good?"
        confirm="Cancel the job"
        dismiss="Keep it"
        dangerous
        onConfirm={() => command(() => post('/v1/jobs/{job_id}/cancel', { path }))}
        onDismiss={() => setAsking(null)}
      >
        <p>
          It cannot be resumed. The {formatCount(job.iterations)} iterations that are committed
          stay; the one under way is lost. To go on later, pause it instead.
        </p>
      </ConfirmDialog>
      <ConfirmDialog
        open={asking === 'delete'}
        title="Delete this job and all that it has found?"
        confirm="Delete the job"
        dismiss="Keep it"
        dangerous
        onConfirm={() => {
          setBusy(true)
          setError(null)
          setAsking(null)
          onDeleting(true)
          remove('/v1/jobs/{job_id}', { path })
            .then(
              () => navigate('/'),
              (problem: unknown) => {
                setError(problem)
                onDeleting(false)
              },
            )
            .finally(() => setBusy(false))
        }}
        onDismiss={() => setAsking(null)}
      >
        <p>
          {formatCount(job.iterations)} iterations with {formatCount(job.evaluations)} evaluated
          designs are lost for good. Forks of the job keep their copies but lose their parent, and
          certificates of its designs stay as jobs of their own.
        </p>
      </ConfirmDialog>
      <PriorityDialog
        key={`priority ${job.id} ${asking === 'priority'}`}
        job={job}
        open={asking === 'priority'}
        onPrioritize={(priority) =>
          command(() => put('/v1/jobs/{job_id}/priority', { path, body: { priority } }))
        }
        onDismiss={() => setAsking(null)}
      />
      <LabelDialog
        key={`label ${job.id} ${asking === 'label'}`}
        job={job}
        open={asking === 'label'}
        onLabel={command}
        onDismiss={() => setAsking(null)}
      />
      <ExtendDialog
        key={`extend ${job.id} ${asking === 'extend'}`}
        job={job}
        open={asking === 'extend'}
        onExtend={(iterations) =>
          command(() => post('/v1/jobs/{job_id}/extend', { path, body: { iterations } }))
        }
        onDismiss={() => setAsking(null)}
      />
    </div>
  )
}

/** Protected from deletion. */
function kept(id: string): Promise<StoredJob> {
  return put('/v1/jobs/{job_id}/keep', { path: { job_id: id } })
}

async function released(id: string): Promise<StoredJob> {
  await remove('/v1/jobs/{job_id}/keep', { path: { job_id: id } })
  return get('/v1/jobs/{job_id}', { path: { job_id: id } })
}

function ExtendDialog({
  job,
  open,
  onExtend,
  onDismiss,
}: {
  job: StoredJob
  open: boolean
  onExtend: (iterations: number) => void
  onDismiss: () => void
}) {
  const [budget, setBudget] = useState(String(job.iterations_planned + 25))
  const wanted = Number(budget)
  const [spent, least] = [budgetSpent(job), iterationsSpent(job)]
  const valid = Number.isInteger(wanted) && wanted > least
  return (
    <ConfirmDialog
      open={open}
      title="Give the job another budget"
      confirm={`Run ${valid ? formatCount(wanted) : '…'} iterations in all`}
      disabled={!valid}
      onConfirm={() => onExtend(wanted)}
      onDismiss={onDismiss}
    >
      <p>
        {spentInWords(spent)} {spent.unit} are done; the job goes on after them.
        {spent.unit === 'designs' &&
          ` The budget counts iterations of ${formatCount(job.particles)} designs each.`}
      </p>
      <div class="field">
        <label for="extend-budget">
          Iterations in all <span class="unit">[1]</span>
        </label>
        <input
          id="extend-budget"
          type="number"
          min={least + 1}
          step={1}
          value={budget}
          aria-invalid={!valid}
          onInput={(event) => setBudget(event.currentTarget.value)}
        />
        {!valid && <span class="wrong">a whole number above {formatCount(least)}</span>}
      </div>
    </ConfirmDialog>
  )
}
