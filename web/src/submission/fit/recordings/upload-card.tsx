/** Form to upload a measured log with a description of its walk. */

import { useId, useState } from 'preact/hooks'
import { post } from '../../../api/client'
import { ApiProblem } from '../../../api/problem'
import type { MeasuredWalk, RobotSource } from '../../../api/types'
import { ErrorNotice } from '../../../components/feedback'
import type { Catalogue } from '../../draft/catalogue'
import { ChoiceField, Problems } from '../../fields/number-field'
import { TextField } from '../../fields/text-field'
import {
  emptyWalk,
  measuredRequest,
  publishedDesign,
  type WalkDraft,
  walkErrors,
} from './measured-walk'
import { ReadLog } from './read-log'

export function UploadCard({
  catalogue,
  robot,
  onRead,
}: {
  catalogue: Catalogue
  robot: RobotSource
  onRead: (read: MeasuredWalk) => void
}) {
  const [draft, setDraft] = useState(() => emptyWalk(catalogue))
  const [file, setFile] = useState<File | null>(null)
  const [read, setRead] = useState<MeasuredWalk | null>(null)
  const [problem, setProblem] = useState<unknown>(null)
  const [reading, setReading] = useState(false)
  const id = useId()
  const change = (changes: Partial<WalkDraft>) => setDraft((old) => ({ ...old, ...changes }))
  const controller = catalogue.controllers.find(({ name }) => name === draft.controller)
  const fieldErrors = problem instanceof ApiProblem ? problem.errors : []
  const errors = walkErrors(fieldErrors)
  const send = async () => {
    if (!file) {
      setProblem(new ApiProblem(422, 'no log', [{ field: 'log', message: 'choose a file first' }]))
      return
    }
    setReading(true)
    setProblem(null)
    setRead(null)
    try {
      const body = measuredRequest(draft, robot, await file.text(), catalogue)
      const answer = await post('/v1/measured-walks', { body })
      setRead(answer)
      onRead(answer)
    } catch (error) {
      setProblem(error)
    } finally {
      setReading(false)
    }
  }
  return (
    <form
      class="card stack"
      noValidate
      aria-labelledby="part-measured"
      onSubmit={(event) => {
        event.preventDefault()
        if (!reading) void send()
      }}
    >
      <h2 id="part-measured">Measured walk</h2>
      <Problems messages={errors.robot === undefined ? [] : [errors.robot]} />
      <div class="fields">
        <div class="field">
          <label for={`${id}-log`}>Log</label>
          <input
            id={`${id}-log`}
            type="file"
            accept=".csv,text/csv"
            aria-invalid={errors.log !== undefined}
            aria-describedby={`${id}-log-hint`}
            onChange={(event) => setFile(event.currentTarget.files?.[0] ?? null)}
          />
          <span id={`${id}-log-hint`} class={errors.log === undefined ? 'hint' : 'wrong'}>
            {errors.log ?? 'CSV with 500 rows per second and units in the column headings'}
          </span>
        </div>
        <ChoiceField
          label="Scenario"
          choices={catalogue.scenarios.map(({ name }) => name)}
          value={draft.scenario}
          error={errors.scenario}
          onChange={(scenario) => change({ scenario })}
        />
        <TextField
          label="Cycles"
          value={draft.cycles}
          hint="number of cycles walked; empty: as in the scenario"
          error={errors.cycles}
          onChange={(cycles) => change({ cycles })}
        />
        <ChoiceField
          label="Controller"
          choices={catalogue.controllers.map(({ name }) => name)}
          value={draft.controller}
          error={errors.controller}
          onChange={(name) => {
            const chosen = catalogue.controllers.find((entry) => entry.name === name)
            const study = Object.keys(chosen?.published ?? {})[0] ?? ''
            change({ controller: name, design: chosen ? publishedDesign(chosen, study) : '{}' })
          }}
        />
        {controller && Object.keys(controller.published).length > 0 && (
          <ChoiceField
            label="Published design to start from"
            choices={Object.keys(controller.published)}
            value={studyOf(controller, draft.design)}
            onChange={(study) => change({ design: publishedDesign(controller, study) })}
          />
        )}
        <div class="field wide">
          <label for={`${id}-design`}>Design as JSON</label>
          <textarea
            id={`${id}-design`}
            rows={4}
            spellcheck={false}
            value={draft.design}
            aria-invalid={errors.design !== undefined}
            aria-describedby={`${id}-design-hint`}
            onInput={(event) => change({ design: event.currentTarget.value })}
          />
          <span id={`${id}-design-hint`} class={errors.design === undefined ? 'hint' : 'wrong'}>
            {errors.design ?? 'the controller’s variables, and gait variables such as stride'}
          </span>
        </div>
      </div>
      <div class="row">
        <button type="submit" disabled={reading}>
          {reading ? 'Uploading…' : 'Upload the log'}
        </button>
      </div>
      {problem !== null && (fieldErrors.length === 0 || errors[''] !== undefined) && (
        <ErrorNotice what="Could not process the log." error={problem} />
      )}
      {read && <ReadLog read={read} />}
    </form>
  )
}

/** Study of a published design; empty for a custom one. */
function studyOf(controller: Catalogue['controllers'][number], design: string): string {
  const studies = Object.keys(controller.published)
  return studies.find((study) => publishedDesign(controller, study) === design) ?? ''
}
