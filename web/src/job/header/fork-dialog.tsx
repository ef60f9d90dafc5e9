/** Dialog to fork a job. */

import { useState } from 'preact/hooks'
import { get, post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { ErrorNotice } from '../../components/feedback'
import { formatCount } from '../../format/number'
import { navigate } from '../../router/navigation'
import { jobPath } from '../../router/routes'
import { ChoiceField } from '../../submission/fields/number-field'
import { TextField } from '../../submission/fields/text-field'

const AS_PARENT = 'same as parent'

/** A button that opens the dialog. */
export function ForkButton({
  job,
  from,
  compact = false,
}: {
  job: StoredJob
  /** First iteration that the fork does not copy. */
  from: number
  compact?: boolean
}) {
  const [open, setOpen] = useState(false)
  return (
    <>
      <button type="button" class={compact ? 'compact' : ''} onClick={() => setOpen(true)}>
        Fork…
      </button>
      {open && <ForkDialog job={job} from={from} onDismiss={() => setOpen(false)} />}
    </>
  )
}

function ForkDialog({
  job,
  from,
  onDismiss,
}: {
  job: StoredJob
  from: number
  onDismiss: () => void
}) {
  const [first, setFirst] = useState(String(from))
  const [budget, setBudget] = useState(String(job.iterations_planned))
  const [name, setName] = useState(job.name)
  const [preference, setPreference] = useState(AS_PARENT)
  const [method, setMethod] = useState(AS_PARENT)
  const [sending, setSending] = useState(false)
  const [error, setError] = useState<unknown>(null)
  const choices = useResource('of a fork', choicesOf)
  const [start, iterations] = [Number(first), Number(budget)]
  const startValid = Number.isInteger(start) && start >= 1 && start <= job.iterations
  const valid = startValid && Number.isInteger(iterations) && iterations > start
  const fork = () => {
    setSending(true)
    setError(null)
    const body = {
      from_iteration: start,
      iterations,
      name,
      start_count: 5,
      accept_changes: false,
      preference: chosen(preference) as 'A' | null,
      optimizer: chosen(method) as 'pso' | null,
    }
    post('/v1/jobs/{job_id}/fork', { path: { job_id: job.id }, body })
      .then((forked) => navigate(jobPath(forked.id)), setError)
      .finally(() => setSending(false))
  }
  return (
    <ConfirmDialog
      open
      title="Fork the job"
      confirm="Fork the job"
      disabled={!valid || sending}
      onConfirm={fork}
      onDismiss={onDismiss}
    >
      <p>
        The fork copies the iterations before the chosen one. With the same preference and method,
        the search continues unchanged. Otherwise the method either replays the copied iterations or
        starts from their best designs.
      </p>
      <TextField
        label="First new iteration"
        value={first}
        hint={`1 to ${formatCount(job.iterations)}; earlier ones are copied`}
        error={
          startValid ? undefined : `must be an integer from 1 to ${formatCount(job.iterations)}`
        }
        onChange={setFirst}
      />
      <TextField
        label="Iterations in total"
        value={budget}
        hint="including the copied ones"
        error={valid || !startValid ? undefined : `must be an integer above ${formatCount(start)}`}
        onChange={setBudget}
      />
      <TextField label="Name" value={name} onChange={setName} />
      {job.kind === 'tuning' && (
        <ChoiceField
          label="Preference"
          choices={[AS_PARENT, ...(choices.data?.preferences ?? [])]}
          value={preference}
          onChange={setPreference}
        />
      )}
      <ChoiceField
        label="Method"
        choices={[AS_PARENT, ...(choices.data?.methods ?? [])]}
        value={method}
        onChange={setMethod}
      />
      {error !== null && <ErrorNotice what="Could not fork the job." error={error} />}
    </ConfirmDialog>
  )
}

function chosen(value: string): string | null {
  return value === AS_PARENT ? null : value
}

async function choicesOf(signal: AbortSignal) {
  const [preferences, optimizers] = await Promise.all([
    get('/v1/preferences', { signal }),
    get('/v1/optimizers', { signal }),
  ])
  return {
    preferences: preferences.items.map(({ name }) => name),
    methods: optimizers.items.map(({ settings }) => settings.name),
  }
}

/** Whether the server allows a fork from this iteration. */
export function canFork(job: Pick<Job, 'links' | 'iterations'>, from: number): boolean {
  return 'fork' in job.links && from >= 1 && from <= job.iterations
}
