/** New-job form, with its estimate and its spec as JSON. */

import { useMemo, useState } from 'preact/hooks'
import { ApiProblem } from '../api/problem'
import type { JobSpec } from '../api/types'
import { errorsByField, specOf, withKinds } from './draft/build-spec'
import { type Catalogue, variablesOf } from './draft/catalogue'
import type { Draft } from './draft/draft'
import { JsonForm } from './json-form'
import { RobotSection } from './robot/section'
import { PreferenceSection } from './sections/preference-section'
import { ScenariosSection } from './sections/scenarios-section'
import { CaseSection, JobSection, OptimizerSection, WorldsSection } from './sections/settings'
import { StartSection } from './sections/start-section'
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
