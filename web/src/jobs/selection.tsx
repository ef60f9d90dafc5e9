/** Selected jobs, and commands for them: compare, archive, delete. */

import { useState } from 'preact/hooks'
import { get, patch, remove } from '../api/client'
import { useCommand } from '../api/resource'
import { ErrorNotice } from '../components/feedback'
import { formatCount } from '../format/number'
import { idsOf } from '../router/query-value'
import { comparePath, jobPath } from '../router/routes'
import { changeAll, DELETED, type Refused, restoreJob } from './deletion'
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
  const { busy, error, during } = useCommand()
  const [done, setDone] = useState<Done | null>(lastDeletion)
  const run = async (verb: Verb, ids: readonly string[]) => {
    const { changed, refused } = await changeAll(ids, SEND[verb])
    setDone({ verb, ids: changed, refused })
    onSelect(selected.filter((id) => !changed.includes(id)))
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
            onClick={() => during(run(query.archived ? 'unarchived' : 'archived', selected))}
          >
            {query.archived ? 'Restore from archive' : 'Archive'}
          </button>
          <button
            type="button"
            class="compact danger"
            disabled={busy}
            title="Deleted jobs can be restored for 24 hours."
            onClick={() => during(run('deleted', selected))}
          >
            Delete
          </button>
          <button type="button" class="compact" onClick={() => onSelect([])}>
            Clear selection
          </button>
        </div>
      )}
      {error !== null && <ErrorNotice what="The command failed." error={error} />}
      {done && (
        <div class="notice" data-tone={done.refused.length > 0 ? 'warn' : 'good'} role="status">
          <div class="row">
            <span>
              {jobsInWords(done.ids.length)} {done.verb}
              {done.refused.length > 0 && `; ${jobsInWords(done.refused.length)} not ${done.verb}`}.
              {done.verb === 'deleted' && ' They can be restored for 24 hours.'}
            </span>
            {done.ids.length > 0 && UNDO[done.verb] && (
              <button
                type="button"
                class="compact"
                disabled={busy}
                onClick={() => during(run(UNDO[done.verb]!, done.ids).then(() => setDone(null)))}
              >
                Undo
              </button>
            )}
            <button type="button" class="compact plain" onClick={() => setDone(null)}>
              Close
            </button>
          </div>
          {done.refused.length > 0 && <Reasons items={done.refused} />}
        </div>
      )}
    </>
  )
}

interface Done {
  readonly verb: Verb
  readonly ids: readonly string[]
  readonly refused: readonly Refused[]
}

type Verb = keyof typeof SEND

const label = (archived: boolean) => (id: string) =>
  patch('/v1/jobs/{job_id}', { path: { job_id: id }, body: { archived } })

const SEND = {
  archived: label(true),
  unarchived: label(false),
  deleted: (id: string) => remove('/v1/jobs/{job_id}', { path: { job_id: id } }),
  restored: restoreJob,
}

const UNDO: Readonly<Partial<Record<Verb, Verb>>> = {
  archived: 'unarchived',
  unarchived: 'archived',
  deleted: 'restored',
}

/** The job deleted on its own page just before, if one was. */
function lastDeletion(): Done | null {
  const ids = idsOf(sessionStorage.getItem(DELETED))
  sessionStorage.removeItem(DELETED)
  return ids.length > 0 ? { verb: 'deleted', ids, refused: [] } : null
}

function Reasons({ items }: { items: readonly Refused[] }) {
  return (
    <ul class="small reasons">
      {items.map(({ id, reason }) => (
        <li key={id}>
          <a href={jobPath(id)}>{id}</a>: {reason}
        </li>
      ))}
    </ul>
  )
}

export function jobsInWords(count: number): string {
  return count === 1 ? '1 job' : `${formatCount(count)} jobs`
}
