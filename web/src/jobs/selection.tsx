/** Selected jobs, and commands for them: compare, archive, delete. */

import { useState } from 'preact/hooks'
import { get, patch, remove } from '../api/client'
import type { JobSummary } from '../api/types'
import { ConfirmDialog } from '../components/confirm-dialog'
import { ErrorNotice } from '../components/feedback'
import { formatCount } from '../format/number'
import { idsOf } from '../router/query-value'
import { comparePath, jobPath } from '../router/routes'
import {
  type Deletion,
  type DeletionPreview,
  deleteAll,
  deletionPreview,
  inTurn,
  lostWith,
} from './deletion'
import { type ListQuery, MOST_COMPARED } from './list-query'

const KEY = 'gaitswarm.selected'

/** Ids kept until the tab is closed: an address cannot hold a thousand. */
export function useSelected() {
  const [ids, setIds] = useState<readonly string[]>(() => idsOf(sessionStorage.getItem(KEY)))
  const select = (next: readonly string[]) => {
    sessionStorage.setItem(KEY, next.join())
    setIds(next)
  }
  return [ids, select] as const
}

/** Jobs in a page of a long list. */
const LARGE_PAGE = 200

async function allIds(query: ListQuery): Promise<readonly string[]> {
  const ids: string[] = []
  for (let after: string | undefined, more = true; more; ) {
    const page = await get('/v1/jobs', { query: { ...query, after, limit: LARGE_PAGE } })
    ids.push(...page.items.map(({ id }) => id))
    more = page.next !== null
    after = page.next ?? undefined
  }
  return ids
}

interface SelectionProps {
  selected: readonly string[]
  query: ListQuery
  /** Whether there are jobs on other pages. */
  more: boolean
  onDone: () => void
  onSelect: (selected: readonly string[]) => void
}

export function Selection({ selected, query, more, onDone, onSelect }: SelectionProps) {
  const [error, setError] = useState<unknown>(null)
  const [preview, setPreview] = useState<DeletionPreview | null>(null)
  const [deletion, setDeletion] = useState<Deletion | null>(null)
  const [moved, setMoved] = useState<{ ids: readonly string[]; archived: boolean } | null>(null)
  const [busy, setBusy] = useState(false)
  const during = (work: Promise<void>) => {
    setError(null)
    setBusy(true)
    work.catch(setError).finally(() => setBusy(false))
  }
  const archive = async (ids: readonly string[], archived: boolean) => {
    await inTurn(ids, (id) =>
      patch('/v1/jobs/{job_id}', { path: { job_id: id }, body: { archived } }),
    )
    onSelect([])
    onDone()
  }
  const deleteJobs = async (jobs: readonly JobSummary[]) => {
    setPreview(null)
    const result = await deleteAll(jobs, (id) =>
      remove('/v1/jobs/{job_id}', { path: { job_id: id } }),
    )
    setDeletion(result)
    const deleted = new Set(result.deleted)
    onSelect(selected.filter((id) => !deleted.has(id)))
    onDone()
  }
  return (
    <>
      {selected.length > 0 && (
        <div class="row selection" data-selected-jobs={selected.length}>
          <strong aria-live="polite">{formatCount(selected.length)} selected</strong>
          {more && (
            <button
              type="button"
              class="compact"
              disabled={busy}
              onClick={() => during(allIds(query).then(onSelect))}
            >
              Select all pages
            </button>
          )}
          <a class="button compact" href={comparePath(selected.slice(0, MOST_COMPARED))}>
            Compare{selected.length > MOST_COMPARED && ` the first ${MOST_COMPARED}`}
          </a>
          <button
            type="button"
            class="compact"
            disabled={busy}
            onClick={() =>
              during(
                archive(selected, !query.archived).then(() =>
                  setMoved({ ids: selected, archived: !query.archived }),
                ),
              )
            }
          >
            {query.archived ? 'Restore from archive' : 'Archive'}
          </button>
          <button
            type="button"
            class="compact danger"
            disabled={busy}
            onClick={() => during(deletionPreview(selected).then(setPreview))}
          >
            Delete…
          </button>
          <button type="button" class="compact" onClick={() => onSelect([])}>
            Clear selection
          </button>
        </div>
      )}
      {error !== null && <ErrorNotice what="The command failed." error={error} />}
      {moved && (
        <div class="notice row" data-tone="good" role="status">
          <span>
            {jobsInWords(moved.ids.length)} {moved.archived ? 'archived' : 'restored'}.
          </span>
          <button
            type="button"
            class="compact"
            disabled={busy}
            onClick={() => during(archive(moved.ids, !moved.archived).then(() => setMoved(null)))}
          >
            Undo
          </button>
          <button type="button" class="compact plain" onClick={() => setMoved(null)}>
            Close
          </button>
        </div>
      )}
      {deletion !== null && <DeletionNote deletion={deletion} onClose={() => setDeletion(null)} />}
      {preview && (
        <ConfirmDialog
          title={`Delete ${jobsInWords(preview.deletable.length)} and their results?`}
          confirm={`Delete ${jobsInWords(preview.deletable.length)}`}
          dangerous
          disabled={preview.deletable.length === 0}
          onConfirm={() => during(deleteJobs(preview.deletable))}
          onDismiss={() => setPreview(null)}
        >
          <PreviewNote preview={preview} />
        </ConfirmDialog>
      )}
    </>
  )
}

function PreviewNote({ preview }: { preview: DeletionPreview }) {
  const lost = lostWith(preview.deletable)
  return (
    <>
      {preview.deletable.length > 0 && (
        <p>
          {formatCount(lost.iterations)} iterations with {formatCount(lost.evaluations)} evaluated
          designs are permanently lost. Forks of the jobs keep their copies but lose their parents;
          certificates of their designs are separate jobs and remain.
        </p>
      )}
      {preview.refused.length > 0 && (
        <>
          <p>{jobsInWords(preview.refused.length)} cannot be deleted:</p>
          <Reasons items={preview.refused} />
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
        {deletion.refused.length > 0 && `; ${jobsInWords(deletion.refused.length)} not deleted`}.
      </p>
      {deletion.refused.length > 0 && <Reasons items={deletion.refused} />}
      <button type="button" class="compact" onClick={onClose}>
        Close
      </button>
    </div>
  )
}

function Reasons({ items }: { items: DeletionPreview['refused'] }) {
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

export function jobsInWords(count: number): string {
  return count === 1 ? '1 job' : `${formatCount(count)} jobs`
}
