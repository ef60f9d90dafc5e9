/** New-job form, with its estimate and its spec as JSON. */

import { useLayoutEffect, useMemo, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { jobSearch } from '../api/jobs'
import { ApiProblem } from '../api/problem'
import { useResource } from '../api/resource'
import type { JobSpec } from '../api/types'
import { Card } from '../components/card'
import { Combobox } from '../components/fields/combobox'
import { Problems, TextField } from '../components/fields/field'
import { RemovableList } from '../components/fields/removable-list'
import { formatCount, formatNumber } from '../format/number'
import { errorsByField, errorsUnder, specOf, withKinds } from './draft/build-spec'
import { type Catalogue, variablesOf } from './draft/catalogue'
import type { Draft } from './draft/draft'
import { NO_START, type StartDraft } from './draft/settings'
import { JsonForm } from './json-form'
import { RobotSection } from './robot/section'
import { EffortSection, ExactPreferenceSection, MattersSection, paceOf } from './sections/matters'
import { ScenariosSection } from './sections/scenarios-section'
import {
  CaseSection,
  JobSection,
  OptimizerSection,
  type SectionProps,
  WorldsSection,
} from './sections/settings'
import { VariablesSection } from './sections/variables-section'
import { SubmitPanel } from './submit-panel'
import { useSubmission } from './use-submission'

interface JobFormProps {
  readonly catalogue: Catalogue
  readonly initial: Draft
  /** Whether all settings are shown from the start. */
  readonly advanced: boolean
  /** Receives every change, and null once the job is submitted. */
  readonly onDraft: (draft: Draft | null) => void
}

export function JobForm({ catalogue, initial, advanced, onDraft }: JobFormProps) {
  const [draft, setDraft] = useState(initial)
  const [asJson, setAsJson] = useState(false)
  const spec = useMemo(() => built(draft, catalogue), [draft, catalogue])
  const { kind, toml, urdf } = draft.robot
  const missing = kind === 'files' && (toml === '' || urdf === '') ? 'Choose your robot first.' : ''
  const submission = useSubmission(spec, missing, () => onDraft(null))
  const { problem, estimate } = submission
  const errors = useMemo(
    () => errorsByField(problem instanceof ApiProblem ? problem.errors : [], draft),
    [problem, draft],
  )
  const pace = useRef<number | null>(null)
  pace.current = paceOf(estimate) ?? pace.current
  // The page may be left at once.
  useLayoutEffect(() => {
    if (draft !== initial) onDraft(draft)
  }, [draft])
  const [open, setOpen] = useState(advanced)
  const invalid = [...errors.keys()].some((key) => !SHOWN.test(key))
  if (asJson) return <JsonForm spec={spec} onBack={() => setAsJson(false)} />
  const parts = {
    draft,
    catalogue,
    errors,
    onChange: (changes: Partial<Draft>) => setDraft((old) => ({ ...old, ...changes })),
  }
  return (
    <form
      class="submission"
      noValidate
      onSubmit={(event) => {
        event.preventDefault()
        submission.submit()
      }}
    >
      <div class="stack">
        <RobotSection {...parts} step />
        <MattersSection {...parts} />
        <ScenariosSection {...parts} />
        <EffortSection {...parts} pace={pace.current} />
        <details
          class="advanced"
          open={open || invalid}
          onToggle={(event) => setOpen(event.currentTarget.open)}
        >
          <summary>Advanced: variables, worlds, search method, start</summary>
          <div class="stack">
            <JobSection {...parts} />
            <VariablesSection {...parts} />
            <ExactPreferenceSection {...parts} />
            <CaseSection {...parts} />
            <WorldsSection {...parts} />
            <OptimizerSection {...parts} />
            <StartSection {...parts} />
          </div>
        </details>
      </div>
      <SubmitPanel
        spec={spec}
        submission={submission}
        missing={missing}
        onJson={() => setAsJson(true)}
      >
        <TextField
          label="Name"
          maxLength={200}
          placeholder="optional"
          value={draft.name}
          error={errors.get('name')}
          onChange={(name) => parts.onChange({ name })}
        />
      </SubmitPanel>
    </form>
  )
}

/** Fields outside of the advanced settings. */
const SHOWN = /^(name|robot|scenarios|custom|preference|$)/

function built(draft: Draft, catalogue: Catalogue): JobSpec {
  const controller = catalogue.controllers.find(({ name }) => name === draft.controller)
  return withKinds(specOf(draft), variablesOf(controller))
}

function StartSection({ draft, errors, onChange }: SectionProps) {
  const { start } = draft
  const problems = errorsUnder(errors, 'start')
  const change = (changes: Partial<StartDraft>) => onChange({ start: { ...start, ...changes } })
  return (
    <Card class="stack-tight" title="Start">
      <RemovableList ids={start.jobs} onChange={(jobs) => change({ jobs })}>
        {(job) => <JobWords id={job} />}
      </RemovableList>
      <div class="fields">
        <Combobox
          label="Best designs of jobs"
          placeholder={start.jobs.length === 0 ? 'none' : 'add another job'}
          hint="Their best designs are evaluated first, as part of the budget."
          invalid={problems.length > 0}
          remote={{
            label: 'Jobs, newest first',
            search: jobSearch('tuning', {
              exclude: start.jobs,
              note: ({ controller }) =>
                controller === draft.controller ? '' : `tunes ${controller}`,
            }),
          }}
          onChoose={(job) => change({ jobs: [...start.jobs, job] })}
        />
        {start.jobs.length > 0 && (
          <TextField
            label="Number of designs"
            inputMode="numeric"
            value={start.count}
            onChange={(count) => change({ count })}
          />
        )}
      </div>
      {start.designs.length > 0 && start.jobs.length === 0 && (
        <p class="row">
          <span>
            The search starts from {formatCount(start.designs.length)} start designs of the cloned
            job.
          </span>
          <button type="button" class="compact" onClick={() => onChange({ start: NO_START })}>
            Remove them
          </button>
        </p>
      )}
      <Problems messages={problems} />
    </Card>
  )
}

/** Name and best fitness of a job; nothing if it is missing, which the estimate reports. */
function JobWords({ id }: { id: string }) {
  const { data } = useResource(id, (signal) =>
    get('/v1/jobs/{job_id}', { path: { job_id: id }, signal }),
  )
  if (data === null) return null
  const fitness = data.best_fitness === null ? '' : `fitness ${formatNumber(data.best_fitness, 4)}`
  return <span class="muted">{[data.name, fitness].filter(Boolean).join(' · ')}</span>
}
