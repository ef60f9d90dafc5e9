/** Dialog to change the priority of a job. */

import { useState } from 'preact/hooks'
import type { StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { HIGHEST, isPriority, LOWEST, PRIORITY_HELP } from '../priority'

export function PriorityDialog({
  job,
  open,
  onPrioritize,
  onDismiss,
}: {
  job: StoredJob
  open: boolean
  onPrioritize: (priority: number) => void
  onDismiss: () => void
}) {
  const [text, setText] = useState(String(job.priority))
  const valid = isPriority(text)
  return (
    <ConfirmDialog
      open={open}
      title="Change the priority"
      confirm="Change priority"
      disabled={!valid}
      onConfirm={() => onPrioritize(Number(text))}
      onDismiss={onDismiss}
    >
      <p>{PRIORITY_HELP}</p>
      <div class="field">
        <label for="job-priority">
          Priority <span class="unit">[1]</span>
        </label>
        <input
          id="job-priority"
          type="number"
          min={LOWEST}
          max={HIGHEST}
          step={1}
          value={text}
          aria-invalid={!valid}
          onInput={(event) => setText(event.currentTarget.value)}
        />
        {!valid && (
          <span class="wrong">
            must be an integer from {LOWEST} to {HIGHEST}
          </span>
        )}
      </div>
    </ConfirmDialog>
  )
}
