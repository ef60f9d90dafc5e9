/** Commands that the state of a job allows. */

import { useEffect, useState } from 'preact/hooks'
import { get, post, put, remove } from '../../api/client'
import { isReadable } from '../../api/jobs'
import { isOffline } from '../../api/problem'
import { useCommand } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { CopyLink } from '../../components/copy-button'
import { ErrorNotice } from '../../components/feedback'
import { Menu, type MenuItem } from '../../components/menu'
import { formatCount } from '../../format/number'
import { DELETED } from '../../jobs/deletion'
import { navigate } from '../../router/navigation'
import { withQuery } from '../../router/routes'
import { canFork, ExtendDialog, ForkDialog, LabelDialog, PriorityDialog } from './dialogs'

type Dialog = 'cancel' | 'extend' | 'fork' | 'label' | 'priority' | null

interface JobActionsProps {
  job: StoredJob
  onJob: (job: StoredJob) => void
  /** Called with true when a deletion starts and with false if it fails; requests stop meanwhile. */
  onDeleting: (deleting: boolean) => void
}

export function JobActions({ job, onJob, onDeleting }: JobActionsProps) {
  const [dialog, setDialog] = useState<Dialog>(null)
  const { busy, error, setError, during: run } = useCommand()
  // The job was loaded again: the connection is back.
  useEffect(() => setError((shown: unknown) => (isOffline(shown) ? null : shown)), [job])
  const during = (work: Promise<void>) => {
    setDialog(null)
    run(work)
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
    sessionStorage.setItem(DELETED, job.id)
    navigate('/')
  }
  const path = { job_id: job.id }
  const can = (name: string) => name in job.links
  const dialogProps = { job, onCommand: command, onDismiss: () => setDialog(null) }
  const clone = (query = {}) => navigate(withQuery('/jobs/new', { clone: job.id, ...query }))
  const readable = isReadable(job)
  const canStart = readable && job.kind === 'tuning' && job.best_fitness !== null
  const items: readonly (MenuItem | false)[] = [
    canFork(job, job.iterations) && { label: 'Fork…', onChoose: () => setDialog('fork') },
    can('extend') && { label: 'Extend…', onChoose: () => setDialog('extend') },
    canStart && { label: 'Start from best design', onChoose: () => clone({ start: job.id }) },
    readable && { label: 'Clone', onChoose: clone },
    { label: 'Label…', onChoose: () => setDialog('label') },
    can('priority') && { label: 'Priority…', onChoose: () => setDialog('priority') },
    job.kept
      ? {
          label: 'Release',
          title: 'Allow deletion',
          onChoose: () => command(() => release(job.id)),
        }
      : {
          label: 'Keep',
          title: 'Protect from deletion',
          onChoose: () => command(() => put(KEEP, { path })),
        },
    can('cancel') && { label: 'Cancel…', dangerous: true, onChoose: () => setDialog('cancel') },
    can('delete') && { label: 'Delete', dangerous: true, onChoose: () => during(deleteJob()) },
  ]
  const main = (label: string, look: string, onClick: () => void) => (
    <button type="button" class={look} disabled={busy} onClick={onClick}>
      {label}
    </button>
  )
  return (
    <div class="actions">
      <div class="row">
        {can('pause') && main('Pause', '', () => command(() => post(PAUSE, { path })))}
        {can('resume') && main('Resume', 'primary', () => command(() => post(RESUME, { path })))}
        <CopyLink />
        <Menu
          label="Actions"
          of={job.name || job.id}
          look=""
          disabled={busy}
          items={items.filter((item) => item !== false)}
        />
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
            A cancelled job cannot be resumed. The {formatCount(job.evaluations)} committed
            evaluations are kept; the current iteration is lost. To continue later, pause the job
            instead.
          </p>
        </ConfirmDialog>
      )}
      {dialog === 'fork' && (
        <ForkDialog job={job} from={job.iterations} onDismiss={dialogProps.onDismiss} />
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
