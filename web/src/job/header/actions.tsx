/** Commands that the state of a job allows. */

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

type Dialog = 'cancel' | 'delete' | 'extend' | 'label' | 'priority' | null

interface Props {
  readonly job: StoredJob
  readonly onJob: (job: StoredJob) => void
  /** Called with true when a deletion starts and with false if it fails; requests stop meanwhile. */
  readonly onDeleting: (deleting: boolean) => void
}

export function JobActions({ job, onJob, onDeleting }: Props) {
  const [dialog, setDialog] = useState<Dialog>(null)
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const command = (send: () => Promise<StoredJob>) => {
    setBusy(true)
    setError(null)
    setDialog(null)
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
          <button type="button" disabled={busy} onClick={() => setDialog('extend')}>
            Extend…
          </button>
        )}
        {can('priority') && (
          <button type="button" disabled={busy} onClick={() => setDialog('priority')}>
            Priority…
          </button>
        )}
        <button type="button" disabled={busy} onClick={() => setDialog('label')}>
          Label…
        </button>
        <button
          type="button"
          disabled={busy}
          title={job.kept ? 'Allow deletion' : 'Protect from deletion'}
          onClick={() => command(() => (job.kept ? release(job.id) : keep(job.id)))}
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
            Start from best design
          </a>
        )}
        {can('cancel') && (
          <button type="button" class="danger" disabled={busy} onClick={() => setDialog('cancel')}>
            Cancel…
          </button>
        )}
        {can('delete') && (
          <button type="button" class="danger" disabled={busy} onClick={() => setDialog('delete')}>
            Delete…
          </button>
        )}
      </div>
      {error !== null && <ErrorNotice what="The command failed." error={error} />}
      <ConfirmDialog
        open={dialog === 'cancel'}
        title="Cancel this job permanently?"
        confirm="Cancel the job"
        dismiss="Back"
        dangerous
        onConfirm={() => command(() => post('/v1/jobs/{job_id}/cancel', { path }))}
        onDismiss={() => setDialog(null)}
      >
        <p>
          A cancelled job cannot be resumed. The {formatCount(job.iterations)} committed iterations
          are kept; the current one is lost. To continue later, pause the job instead.
        </p>
      </ConfirmDialog>
      <ConfirmDialog
        open={dialog === 'delete'}
        title="Delete this job and its results?"
        confirm="Delete the job"
        dismiss="Back"
        dangerous
        onConfirm={() => {
          setBusy(true)
          setError(null)
          setDialog(null)
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
        onDismiss={() => setDialog(null)}
      >
        <p>
          {formatCount(job.iterations)} iterations with {formatCount(job.evaluations)} evaluated
          designs are permanently lost. Forks of the job keep their copies but lose their parent;
          certificates of its designs are separate jobs and remain.
        </p>
      </ConfirmDialog>
      <PriorityDialog
        key={`priority ${job.id} ${dialog === 'priority'}`}
        job={job}
        open={dialog === 'priority'}
        onPrioritize={(priority) =>
          command(() => put('/v1/jobs/{job_id}/priority', { path, body: { priority } }))
        }
        onDismiss={() => setDialog(null)}
      />
      <LabelDialog
        key={`label ${job.id} ${dialog === 'label'}`}
        job={job}
        open={dialog === 'label'}
        onLabel={command}
        onDismiss={() => setDialog(null)}
      />
      <ExtendDialog
        key={`extend ${job.id} ${dialog === 'extend'}`}
        job={job}
        open={dialog === 'extend'}
        onExtend={(iterations) =>
          command(() => post('/v1/jobs/{job_id}/extend', { path, body: { iterations } }))
        }
        onDismiss={() => setDialog(null)}
      />
    </div>
  )
}

function keep(id: string): Promise<StoredJob> {
  return put('/v1/jobs/{job_id}/keep', { path: { job_id: id } })
}

async function release(id: string): Promise<StoredJob> {
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
  const iterations = Number(budget)
  const [spent, least] = [budgetSpent(job), iterationsSpent(job)]
  const valid = Number.isInteger(iterations) && iterations > least
  return (
    <ConfirmDialog
      open={open}
      title="Extend the budget"
      confirm={`Run ${valid ? formatCount(iterations) : '…'} iterations in total`}
      disabled={!valid}
      onConfirm={() => onExtend(iterations)}
      onDismiss={onDismiss}
    >
      <p>
        {spentInWords(spent)} {spent.unit} are done.
        {spent.unit === 'designs' &&
          ` The budget counts iterations of ${formatCount(job.particles)} designs each.`}
      </p>
      <div class="field">
        <label for="extend-budget">
          Iterations in total <span class="unit">[1]</span>
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
        {!valid && <span class="wrong">must be an integer above {formatCount(least)}</span>}
      </div>
    </ConfirmDialog>
  )
}
