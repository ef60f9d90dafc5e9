/** Commands that the state of a job allows. */

import { useState } from 'preact/hooks'
import { get, post, put, remove } from '../../api/client'
import { isReadable } from '../../api/jobs'
import type { StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { ErrorNotice } from '../../components/feedback'
import { formatCount } from '../../format/number'
import { navigate } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { canFork, ExtendDialog, ForkButton, LabelDialog, PriorityDialog } from './dialogs'

type Dialog = 'cancel' | 'delete' | 'extend' | 'label' | 'priority' | null

interface JobActionsProps {
  job: StoredJob
  onJob: (job: StoredJob) => void
  /** Called with true when a deletion starts and with false if it fails; requests stop meanwhile. */
  onDeleting: (deleting: boolean) => void
}

export function JobActions({ job, onJob, onDeleting }: JobActionsProps) {
  const [dialog, setDialog] = useState<Dialog>(null)
  const [busy, setBusy] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const during = (work: Promise<void>) => {
    setBusy(true)
    setError(null)
    setDialog(null)
    work.catch(setError).finally(() => setBusy(false))
  }
  const command = (send: () => Promise<StoredJob>) => during(send().then(onJob))
  const deleteJob = async () => {
    onDeleting(true)
    try {
      await remove('/v1/jobs/{job_id}', { path })
    } catch (problem) {
      onDeleting(false)
      throw problem
    }
    navigate('/')
  }
  const path = { job_id: job.id }
  const can = (name: string) => name in job.links
  const button = (label: string, onClick: () => void, look = '', title?: string) => (
    <button type="button" class={look} disabled={busy} title={title} onClick={onClick}>
      {label}
    </button>
  )
  const dialogProps = { job, onCommand: command, onDismiss: () => setDialog(null) }
  return (
    <div class="stack-tight actions">
      <div class="row">
        {can('pause') && button('Pause', () => command(() => post(PAUSE, { path })))}
        {can('resume') && button('Resume', () => command(() => post(RESUME, { path })), 'primary')}
        {can('extend') && button('Extend…', () => setDialog('extend'))}
        {can('priority') && button('Priority…', () => setDialog('priority'))}
        {button('Label…', () => setDialog('label'))}
        {job.kept
          ? button('Release', () => command(() => release(job.id)), '', 'Allow deletion')
          : button('Keep', () => command(() => put(KEEP, { path })), '', 'Protect from deletion')}
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
        {can('cancel') && button('Cancel…', () => setDialog('cancel'), 'danger')}
        {can('delete') && button('Delete…', () => setDialog('delete'), 'danger')}
      </div>
      {error !== null && <ErrorNotice what="The command failed." error={error} />}
      {dialog === 'cancel' && (
        <ConfirmDialog
          title="Cancel this job permanently?"
          confirm="Cancel the job"
          dangerous
          onConfirm={() => command(() => post('/v1/jobs/{job_id}/cancel', { path }))}
          onDismiss={dialogProps.onDismiss}
        >
          <p>
            A cancelled job cannot be resumed. The {formatCount(job.iterations)} committed
            iterations are kept; the current one is lost. To continue later, pause the job instead.
          </p>
        </ConfirmDialog>
      )}
      {dialog === 'delete' && (
        <ConfirmDialog
          title="Delete this job and its results?"
          confirm="Delete the job"
          dangerous
          onConfirm={() => during(deleteJob())}
          onDismiss={dialogProps.onDismiss}
        >
          <p>
            {formatCount(job.iterations)} iterations with {formatCount(job.evaluations)} evaluated
            designs are permanently lost. Forks of the job keep their copies but lose their parent;
            certificates of its designs are separate jobs and remain.
          </p>
        </ConfirmDialog>
      )}
      {dialog === 'priority' && <PriorityDialog {...dialogProps} />}
      {dialog === 'label' && <LabelDialog {...dialogProps} />}
      {dialog === 'extend' && <ExtendDialog {...dialogProps} />}
    </div>
  )
}

const PAUSE = '/v1/jobs/{job_id}/pause'
const RESUME = '/v1/jobs/{job_id}/resume'
const KEEP = '/v1/jobs/{job_id}/keep'

async function release(id: string): Promise<StoredJob> {
  await remove(KEEP, { path: { job_id: id } })
  return get('/v1/jobs/{job_id}', { path: { job_id: id } })
}
