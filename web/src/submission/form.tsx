/** New-job form, with its estimate and its spec as JSON. */

import { useMemo, useState } from 'preact/hooks'
import { get } from '../api/client'
import { jobSearch } from '../api/jobs'
import { ApiProblem } from '../api/problem'
import { useResource } from '../api/resource'
import type { JobSpec } from '../api/types'
import { Card } from '../components/card'
import { Combobox } from '../components/fields/combobox'
import { Segmented } from '../components/fields/controls'
import { Problems, TextField } from '../components/fields/field'
import { RemovableList } from '../components/fields/removable-list'
import { Table } from '../components/table/table'
import { formatCount, formatExact, formatNumber } from '../format/number'
import { inWords } from '../format/words'
import { weighed } from '../job/preference'
import { errorsByField, errorsUnder, specOf, withKinds } from './draft/build-spec'
import { type Catalogue, variablesOf } from './draft/catalogue'
import { type Draft, preferenceDraft } from './draft/draft'
import { NO_START, type StartDraft } from './draft/settings'
import { JsonForm } from './json-form'
import { RobotSection } from './robot/section'
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

export function JobForm({ catalogue, initial }: { catalogue: Catalogue; initial: Draft }) {
  const [draft, setDraft] = useState(initial)
  const [asJson, setAsJson] = useState(false)
  const spec = useMemo(() => built(draft, catalogue), [draft, catalogue])
  const submission = useSubmission(spec)
  const { problem } = submission
  const errors = useMemo(
    () => errorsByField(problem instanceof ApiProblem ? problem.errors : [], draft),
    [problem, draft],
  )
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
        <JobSection {...parts} />
        <RobotSection {...parts} />
        <VariablesSection {...parts} />
        <ScenariosSection {...parts} />
        <PreferenceSection {...parts} />
        <CaseSection {...parts} />
        <WorldsSection {...parts} />
        <OptimizerSection {...parts} />
        <StartSection {...parts} />
      </div>
      <SubmitPanel spec={spec} submission={submission} onJson={() => setAsJson(true)} />
    </form>
  )
}

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

function PreferenceSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { preference } = draft
  const objectives = weighed(preference)
  const weight = (part: 'bias' | 'exponent', objective: string) => {
    const index = objectives.indexOf(objective)
    const value = preference[part][index]
    if (preference.kind !== 'custom') return formatExact(Number(value))
    const error = errors.get(`preference.${part}.${index}`)
    const change = (text: string) => {
      const values = preference[part].map((old, k) => (k === index ? text : old))
      onChange({ preference: { ...preference, [part]: values } })
    }
    return (
      <>
        <input
          class="short"
          inputMode="decimal"
          aria-label={`${part} of ${inWords(objective)}`}
          aria-invalid={error !== undefined}
          value={value}
          onInput={(event) => change(event.currentTarget.value)}
        />
        {error !== undefined && <span class="wrong"> {error}</span>}
      </>
    )
  }
  return (
    <Card title="Preference">
      <div class="stack">
        <Segmented
          roomy
          label="Preference"
          value={preference.kind}
          options={[...catalogue.preferences.map(({ name }) => name), 'custom'].map(
            (name) => [name, name] as const,
          )}
          onChoose={(kind) =>
            onChange({
              preference:
                kind === 'custom' ? { ...preference, kind } : preferenceDraft(catalogue, kind),
            })
          }
        />
        <Problems messages={[errors.get('preference')]} />
        <Table<string>
          caption="Biases and exponents of the objectives"
          rows={objectives}
          columns={[
            { key: 'objective f', header: true, cell: inWords },
            { key: 'bias b, in the unit of f', cell: (objective) => weight('bias', objective) },
            { key: 'exponent e', cell: (objective) => weight('exponent', objective) },
          ]}
        />
        <p class="muted small">
          A scenario’s utility is the product of (b + f)<sup>e</sup>; the fitness is the geometric
          mean over the scenarios.
        </p>
      </div>
    </Card>
  )
}
