/** Form to upload a measured log with a description of its walk. */

import { useState } from 'preact/hooks'
import { post } from '../../../api/client'
import { ApiProblem } from '../../../api/problem'
import type { MeasuredWalk, RobotSource } from '../../../api/types'
import { ErrorNotice } from '../../../components/feedback'
import { ChoiceField, FileField, Problems, TextField } from '../../../components/fields/field'
import { Table } from '../../../components/table/table'
import { formatCount, formatNumber } from '../../../format/number'
import type { Catalogue } from '../../draft/catalogue'
import {
  emptyWalk,
  measuredRequest,
  publishedDesign,
  type WalkDraft,
  walkErrors,
} from './measured-walk'

interface UploadCardProps {
  catalogue: Catalogue
  robot: RobotSource
  onRead: (read: MeasuredWalk) => void
}

export function UploadCard({ catalogue, robot, onRead }: UploadCardProps) {
  const [draft, setDraft] = useState(() => emptyWalk(catalogue))
  const [file, setFile] = useState<File | null>(null)
  const [read, setRead] = useState<MeasuredWalk | null>(null)
  const [problem, setProblem] = useState<unknown>(null)
  const [reading, setReading] = useState(false)
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
      <Problems messages={[errors.robot]} />
      <div class="fields">
        <FileField
          label="Log"
          accept=".csv,text/csv"
          hint="CSV with 500 rows per second and units in the column headings"
          error={errors.log}
          onFile={setFile}
        />
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
        <TextField
          wide
          label="Design as JSON"
          rows={4}
          spellcheck={false}
          value={draft.design}
          hint="the controller’s variables, and gait variables such as stride"
          error={errors.design}
          onChange={(design) => change({ design })}
        />
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

function studyOf(controller: Catalogue['controllers'][number], design: string): string {
  const studies = Object.keys(controller.published)
  return studies.find((study) => publishedDesign(controller, study) === design) ?? ''
}

/** Correlation of desired angles below which the log probably shows another walk. */
const SAME_WALK = 0.95

function ReadLog({ read }: { read: MeasuredWalk }) {
  const { recording, verdict } = read
  const failed = verdict.gates.filter(({ passed }) => !passed)
  return (
    <section class="stack-tight" aria-label="Log summary" data-recording={recording.id}>
      <p role="status">
        {recording.synthetic ? 'Synthetic log, simulated rather than measured: ' : 'Log: '}
        {formatNumber(read.seconds, 4)} s in {formatCount(read.rows)} rows. The walk starts{' '}
        {formatNumber(Math.abs(read.offset), 3)} s {read.offset < 0 ? 'before' : 'into'} the log.{' '}
        {formatCount(read.cycles)} complete {read.cycles === 1 ? 'cycle' : 'cycles'} of{' '}
        {formatNumber(read.cycle_time, 3)} s are compared, {formatNumber(recording.seconds, 4)} s in
        total. Mean current: {formatNumber(recording.mean_current, 3)} A.
      </p>
      <p class={read.correlation < SAME_WALK ? 'wrong' : undefined}>
        Correlation of its desired angles with the simulated ones:{' '}
        {formatNumber(read.correlation, 4)}
        {read.correlation < SAME_WALK && '. This is low: check scenario, cycles and design'}.
      </p>
      <p>
        {verdict.validated
          ? 'The log validates the model.'
          : `The log does not validate the model. ${failed.map(({ quantity, reason }) => `${quantity}: ${reason}.`).join(' ')}`}
      </p>
      <Table
        caption="Signals of the log"
        rows={read.signals}
        columns={[
          { key: 'signal', header: true, value: ({ name }) => name },
          { key: 'description', minor: true, value: ({ description }) => description },
          { key: 'unit', value: ({ unit }) => unit },
          {
            key: 'channels',
            numeric: true,
            value: ({ channels }) => channels,
            cell: ({ channels }) => (channels === 0 ? 'not measured' : channels),
          },
        ]}
      />
    </section>
  )
}
