/** Dialog to edit the name, note, tags and archive flag of a job. */

import { useState } from 'preact/hooks'
import { patch } from '../../api/client'
import type { StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'

export interface Labels {
  readonly name: string
  readonly note: string
  readonly tags: string[]
  readonly archived: boolean
}

export function LabelDialog({
  job,
  open,
  onLabel,
  onDismiss,
}: {
  job: StoredJob
  open: boolean
  onLabel: (send: () => Promise<StoredJob>) => void
  onDismiss: () => void
}) {
  const [labels, setLabels] = useState<Labels>({
    name: job.name,
    note: job.note ?? '',
    tags: job.tags ?? [],
    archived: job.archived ?? false,
  })
  const change = (changes: Partial<Labels>) => setLabels({ ...labels, ...changes })
  const tags = labels.tags.map((tag) => tag.trim()).filter((tag) => tag !== '')
  const body = { ...labels, tags }
  return (
    <ConfirmDialog
      open={open}
      title="Name, note and tags"
      confirm="Save"
      onConfirm={() =>
        onLabel(() => patch('/v1/jobs/{job_id}', { path: { job_id: job.id }, body }))
      }
      onDismiss={onDismiss}
    >
      <div class="stack-tight">
        <label class="field">
          Name
          <input
            value={labels.name}
            maxLength={200}
            onInput={(event) => change({ name: event.currentTarget.value })}
          />
        </label>
        <label class="field">
          Tags, comma-separated
          <input
            value={labels.tags.join(',')}
            onInput={(event) => change({ tags: event.currentTarget.value.split(',') })}
          />
        </label>
        <label class="field">
          Note
          <textarea
            rows={4}
            maxLength={10_000}
            value={labels.note}
            onInput={(event) => change({ note: event.currentTarget.value })}
          />
        </label>
        <label class="check">
          <input
            type="checkbox"
            checked={labels.archived}
            onChange={(event) => change({ archived: event.currentTarget.checked })}
          />
          archived: hidden in lists, but not deleted
        </label>
        <p class="muted small">Labels do not affect results.</p>
      </div>
    </ConfirmDialog>
  )
}
