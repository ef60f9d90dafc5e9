/** What can be done with several jobs at once: compare, archive, delete. */

import { useState } from 'preact/hooks'
import { patch, remove } from '../api/client'
import type { JobSummary } from '../api/types'
import { ConfirmDialog } from '../components/confirm-dialog'
import { ErrorNotice } from '../components/feedback'
import { formatCount } from '../format/number'
import { comparePath, jobPath } from '../router/routes'
import { type Deletion, deleteAll, type Fate, lookedUp, lostWith } from './deletion'

/** Jobs that can be compared at once. */
const MOST_COMPARED = 12

export function Chosen({
  chosen,
  archived,
  onDone,
  onChoose,
}: {
  chosen: readonly string[]
  /** Whether the list shows the archive. */
  archived: boolean
  onDone: () => void
  onChoose: (chosen: readonly string[]) => void
}) {
  const [error, setError] = useState<unknown>(null)
  const [asked, setAsked] = useState<Fate | null>(null)
  const [deletion, setDeletion] = useState<Deletion | null>(null)
  const [busy, setBusy] = useState(false)
  const during = (work: Promise<void>) => {
    setError(null)
    setBusy(true)
    work.catch(setError).finally(() => setBusy(false))
  }
  const archive = async () => {
    const body = { archived: !archived }
    await Promise.all(
      chosen.map((id) => patch('/v1/jobs/{job_id}', { path: { job_id: id }, body })),
    )
    onChoose([])
    onDone()
  }
  const deleteThem = async (jobs: readonly JobSummary[]) => {
    setAsked(null)
    const done = await deleteAll(jobs, (id) =>
      remove('/v1/jobs/{job_id}', { path: { job_id: id } }),
    )
    setDeletion(done)
    const gone = new Set(done.deleted)
    onChoose(chosen.filter((id) => !gone.has(id)))
    onDone()
  }
  return (
    <>
      {chosen.length > 0 && (
        <div class="row chosen" data-chosen={chosen.length}>
          <strong aria-live="polite">{formatCount(chosen.length)} chosen</strong>
          {chosen.length <= MOST_COMPARED ? (
            <a class="button compact" href={comparePath(chosen)}>
              Compare
            </a>
          ) : (
            <span class="muted small">at most {MOST_COMPARED} can be compared</span>
          )}
          <button type="button" class="compact" disabled={busy} onClick={() => during(archive())}>
            {archived ? 'Take back from the archive' : 'Archive'}
          </button>
          <button
            type="button"
            class="compact danger"
            disabled={busy}
            onClick={() => during(lookedUp(chosen).then(setAsked))}
          >
            Delete…
          </button>
          <button type="button" class="compact" onClick={() => onChoose([])}>
            Choose none
          </button>
        </div>
      )}
      {error !== null && <ErrorNotice what="That was not done." error={error} />}
      {deletion !== null && <DeletionNote deletion={deletion} onClose={() => setDeletion(null)} />}
      <ConfirmDialog
        open={asked !== null}
        title={`Delete ${jobsInWords(asked?.deletable.length ?? 0)} and all that they have found?`}
        confirm={`Delete ${jobsInWords(asked?.deletable.length ?? 0)}`}
        dismiss="Keep them"
        dangerous
        disabled={asked === null || asked.deletable.length === 0}
        onConfirm={() => asked && during(deleteThem(asked.deletable))}
        onDismiss={() => setAsked(null)}
      >
        {asked && <FateNote fate={asked} />}
      </ConfirmDialog>
    </>
  )
}

function FateNote({ fate }: { fate: Fate }) {
  const lost = lostWith(fate.deletable)
  return (
    <>
      {fate.deletable.length > 0 && (
        <p>
          {formatCount(lost.iterations)} iterations with {formatCount(lost.evaluations)} evaluated
          designs are lost for good. Forks of the jobs keep their copies but lose their parents, and
          certificates of their designs stay as jobs of their own.
        </p>
      )}
      {fate.refused.length > 0 && (
        <>
          <p>{jobsInWords(fate.refused.length)} may not be deleted and will stay:</p>
          <Reasons items={fate.refused} />
        </>
      )}
    </>
  )
}

function DeletionNote({ deletion, onClose }: { deletion: Deletion; onClose: () => void }) {
  return (
    <div class="notice" data-tone={deletion.refused.length > 0 ? 'warn' : 'good'} role="status">
      <p>
        {jobsInWords(deletion.deleted.length)} deleted
        {deletion.refused.length > 0 && `; ${jobsInWords(deletion.refused.length)} stayed`}.
      </p>
      {deletion.refused.length > 0 && <Reasons items={deletion.refused} />}
      <button type="button" class="compact" onClick={onClose}>
        Close
      </button>
    </div>
  )
}

function Reasons({ items }: { items: Fate['refused'] }) {
  return (
    <ul class="small reasons">
      {items.map(({ id, name, reason }) => (
        <li key={id}>
          <a href={jobPath(id)}>{name || id}</a>: {reason}
        </li>
      ))}
    </ul>
  )
}

function jobsInWords(count: number): string {
  return count === 1 ? '1 job' : `${formatCount(count)} jobs`
}
