/** Dialogs of a job's commands. */

import { useState } from 'preact/hooks'
import { get, patch, post, put } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import { useCommand, useResource } from '../../api/resource'
import type { Job, StoredJob } from '../../api/types'
import { ConfirmDialog } from '../../components/confirm-dialog'
import { ErrorNotice } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { ChoiceField, TextField } from '../../components/fields/field'
import { formatCount } from '../../format/number'
import { navigate } from '../../router/navigation'
import { jobPath } from '../../router/routes'
import { type Measure, MeasureFields, measureOf } from '../../submission/sections/measure'
import {
  budgetSpent,
  HIGHEST,
  isPriority,
  LOWEST,
  PRIORITY_ERROR,
  PRIORITY_HELP,
  spentInWords,
} from '../facts'

export interface DialogProps {
  readonly job: StoredJob
  readonly onCommand: (send: () => Promise<StoredJob>) => void
  readonly onDismiss: () => void
}

export function PriorityDialog({ job, onCommand, onDismiss }: DialogProps) {
  const [priority, setPriority] = useState(String(job.priority))
  const valid = isPriority(priority)
  const body = { priority: Number(priority) }
  return (
    <ConfirmDialog
      title="Change the priority"
      confirm="Change priority"
      disabled={!valid}
      onConfirm={() =>
        onCommand(() => put('/v1/jobs/{job_id}/priority', { path: { job_id: job.id }, body }))
      }
      onDismiss={onDismiss}
    >
      <p>{PRIORITY_HELP}</p>
      <TextField
        label="Priority"
        type="number"
        min={LOWEST}
        max={HIGHEST}
        step={1}
        value={priority}
        error={valid ? undefined : PRIORITY_ERROR}
        onChange={setPriority}
      />
    </ConfirmDialog>
  )
}

export function ExtendDialog({ job, onCommand, onDismiss }: DialogProps) {
  const budget = useBudget(job, job.evaluations)
  const options = { path: { job_id: job.id }, body: { iterations: budget.iterations } }
  return (
    <ConfirmDialog
      title="Extend the budget"
      confirm={`Run ${budget.valid ? formatCount(budget.evaluations) : '…'} evaluations in total`}
      disabled={!budget.valid}
      onConfirm={() => onCommand(() => post('/v1/jobs/{job_id}/extend', options))}
      onDismiss={onDismiss}
    >
      <p>{spentInWords(budgetSpent(job))} are done.</p>
      {budget.field}
    </ConfirmDialog>
  )
}

/** Budget of an extended or forked job, in evaluations; the API counts iterations of full size. */
function useBudget(job: StoredJob, done: number) {
  const { particles, evaluations_planned: planned } = job
  const [text, setText] = useState('')
  const usual = planned > done ? planned : done + Math.max(planned, particles)
  const evaluations = Number(text === '' ? usual : text)
  const iterations = Math.ceil(evaluations / particles)
  const valid = Number.isInteger(evaluations) && evaluations > done
  const field = (
    <TextField
      label="Evaluations in total"
      type="number"
      min={done + 1}
      step={1}
      value={text === '' ? String(usual) : text}
      hint={`in iterations of ${formatCount(particles)}`}
      error={valid ? undefined : `must be an integer above ${formatCount(done)}`}
      onChange={setText}
    />
  )
  return { evaluations: iterations * particles, iterations, valid, field }
}

export function LabelDialog({ job, onCommand, onDismiss }: DialogProps) {
  const [name, setName] = useState(job.name)
  const [note, setNote] = useState(job.note ?? '')
  const [tags, setTags] = useState((job.tags ?? []).join(','))
  const [archived, setArchived] = useState(job.archived ?? false)
  const save = () => {
    const tagList = tags.split(',').map((tag) => tag.trim())
    const body = { name, note, archived, tags: tagList.filter((tag) => tag !== '') }
    onCommand(() => patch('/v1/jobs/{job_id}', { path: { job_id: job.id }, body }))
  }
  return (
    <ConfirmDialog
      title="Name, note and tags"
      confirm="Save"
      onConfirm={save}
      onDismiss={onDismiss}
    >
      <TextField label="Name" maxLength={200} value={name} onChange={setName} />
      <TextField label="Tags, comma-separated" value={tags} onChange={setTags} />
      <TextField label="Note" rows={4} maxLength={10_000} value={note} onChange={setNote} />
      <Check
        small={false}
        label="archived: hidden in lists, but not deleted"
        checked={archived}
        onChange={setArchived}
      />
      <p class="muted small">Labels do not affect results.</p>
    </ConfirmDialog>
  )
}

export function canFork(job: Pick<Job, 'links' | 'iterations'>, from: number): boolean {
  return 'fork' in job.links && from >= 1 && from <= job.iterations
}

interface ForkProps {
  readonly job: StoredJob
  /** First iteration that the fork does not copy. */
  readonly from: number
}

export function ForkButton({ compact = false, ...props }: ForkProps & { compact?: boolean }) {
  const [open, setOpen] = useState(false)
  return (
    <>
      <button type="button" class={compact ? 'compact' : ''} onClick={() => setOpen(true)}>
        Fork…
      </button>
      {open && <ForkDialog {...props} onDismiss={() => setOpen(false)} />}
    </>
  )
}

const AS_PARENT = 'same as parent'

export function ForkDialog({ job, from, onDismiss }: ForkProps & { onDismiss: () => void }) {
  const [first, setFirst] = useState(String(from))
  const [name, setName] = useState(job.name)
  const [preference, setPreference] = useState(AS_PARENT)
  const [method, setMethod] = useState(AS_PARENT)
  const [measure, setMeasure] = useState(() => measureIn(job))
  const { busy, error, during } = useCommand()
  const preferences = useResource('preferences', (signal) => get('/v1/preferences', { signal }))
  const optimizers = useResource('optimizers', (signal) => get('/v1/optimizers', { signal }))
  const start = Number(first)
  const startValid = Number.isInteger(start) && start >= 1 && start <= job.iterations
  // Iterations may be smaller than planned; their mean size is exact for all of them.
  const copied = startValid ? Math.round((job.evaluations * start) / job.iterations) : 0
  const budget = useBudget(job, copied)
  const last = formatCount(job.iterations)
  const changed = (value: string) => (value === AS_PARENT ? null : value)
  const fork = () => {
    const body = {
      from_iteration: start,
      iterations: budget.iterations,
      name,
      start_count: 5,
      accept_changes: false,
      preference: changed(preference) as 'A' | null,
      optimizer: changed(method) as 'pso' | null,
      particles: method === AS_PARENT ? null : job.particles,
      ...changesOf(measure, measureIn(job), job.scenarios),
    }
    const forked = post('/v1/jobs/{job_id}/fork', { path: { job_id: job.id }, body })
    during(forked.then(({ id }) => navigate(jobPath(id))))
  }
  return (
    <ConfirmDialog
      title="Fork the job"
      disabled={!startValid || !budget.valid || busy}
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
        hint={
          startValid && `1 to ${last}; the ${formatCount(copied)} evaluations before it are copied`
        }
        error={startValid ? undefined : `must be an integer from 1 to ${last}`}
        onChange={setFirst}
      />
      {budget.field}
      <TextField label="Name" value={name} onChange={setName} />
      {job.kind === 'tuning' && (
        <ChoiceField
          label="Preference"
          choices={[AS_PARENT, ...(preferences.data?.items ?? []).map((each) => each.name)]}
          value={preference}
          onChange={setPreference}
        />
      )}
      <ChoiceField
        label="Method"
        choices={[AS_PARENT, ...(optimizers.data?.items ?? []).map((each) => each.settings.name)]}
        value={method}
        onChange={setMethod}
      />
      {job.kind === 'tuning' && job.scenarios.length > 1 && (
        <MeasureFields
          names={job.scenarios}
          {...measure}
          errors={
            new Map(
              (error instanceof ApiProblem ? error.errors : []).map((e) => [e.field, e.message]),
            )
          }
          onChange={(changes) => setMeasure((old) => ({ ...old, ...changes }))}
        />
      )}
      {error !== null && <ErrorNotice what="Could not fork the job." error={error} />}
    </ConfirmDialog>
  )
}

function measureIn({ spec }: StoredJob): Measure {
  const { scenario_weights: weights = {}, scenario_aggregate: aggregate = 'mean' } =
    spec?.kind === 'tuning' ? spec : {}
  const texts = Object.entries(weights).map(([name, weight]) => [name, String(weight)])
  return { weights: Object.fromEntries(texts), aggregate }
}

/** Both fields of a fork's measure if it differs from that of the parent. */
function changesOf(measure: Measure, parent: Measure, names: readonly string[]) {
  const [fork, before] = [measureOf(names, measure), measureOf(names, parent)]
  if (JSON.stringify(fork) === JSON.stringify(before)) return {}
  return { scenario_weights: {}, scenario_aggregate: 'mean' as const, ...fork }
}
