/** Fitted parameters: values, and their agreement between runs (fig. 2.14). */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { ApiProblem } from '../../api/problem'
import { readableJob } from '../../api/readable'
import { usePolling, useResource } from '../../api/resource'
import type { FittedParameter, Identifiability, Job } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { matching } from '../../components/table/rows'
import { setQuery, usePlace } from '../../router/navigation'
import { caseWords, fitnessUnit } from '../fitness'
import { isRunning } from '../state'
import { ChoicesCard } from './choices-card'
import { IntervalPanels } from './interval-panels'
import { DECISIVE, isCategorical, type Trust } from './intervals'
import './parameters.css'
import { ParametersTable } from './parameters-table'
import { RunPicker } from './run-picker'
import { labelsOf, runsOf, wordOfRuns } from './runs'
import { Verdicts } from './verdicts'

/** Polling interval while the job runs [ms]. */
const RENEW_MS = 15_000

/** Designs among which the runs must agree. */
function agreementOf(kind: Job['kind']): string {
  return kind === 'calibration'
    ? 'among designs whose sum of squared differences, in tolerances, exceeds that of their run’s' +
        ' best by at most 4'
    : 'at 5 %'
}

export function ParametersPanel({ job }: { job: Job }) {
  const { query } = usePlace()
  if (!job.best) {
    return (
      <section class="card">
        <Empty title="No parameters yet">
          <p>
            No parameter set has succeeded in every {caseWords(job.kind).item} yet. The first one
            that does appears here.
          </p>
        </Empty>
      </section>
    )
  }
  return <Fitted job={job} also={runsOf(query, job.id)} />
}

function Fitted({ job, also }: { job: Job; also: readonly string[] }) {
  const key = [job.id, ...also].join()
  const identifiability = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/parameters', {
      path: { job_id: job.id },
      query: { also: [...also] },
      signal,
    }),
  )
  const runs = useResource(key, (signal) => Promise.all(also.map((id) => readableJob(id, signal))))
  usePolling(identifiability.reload, RENEW_MS, isRunning(job))
  const choose = (ids: readonly string[]) => setQuery({ also: wordOfRuns(ids) })
  const compared = [job, ...(runs.data ?? [])]
  return (
    <div class="stack">
      <RunPicker job={job} runs={compared} also={also} onChoose={choose} />
      {identifiability.error && (
        <>
          <ErrorNotice
            what="Could not compare these runs."
            error={identifiability.error}
            retry={isMissing(identifiability.error) ? undefined : identifiability.reload}
          />
          {also.length > 0 && (
            <p class="row">
              <button type="button" onClick={() => choose([])}>
                Remove the other runs
              </button>
              <span class="muted">
                Or remove the runs above that do not belong here or have no parameters yet.
              </span>
            </p>
          )}
        </>
      )}
      {!identifiability.data && identifiability.loading && (
        <Loading what="all designs of these runs" />
      )}
      {identifiability.data && (
        <Parameters
          job={job}
          identifiability={identifiability.data}
          labels={labelsOf(identifiability.data.jobs, compared)}
        />
      )}
    </div>
  )
}

/** A missing job will not appear. */
function isMissing(error: Error): boolean {
  return error instanceof ApiProblem && error.status === 404
}

function Parameters({
  job,
  identifiability,
  labels,
}: {
  job: Job
  identifiability: Identifiability
  labels: readonly string[]
}) {
  const [text, setText] = useState('')
  const [trust, setTrust] = useState<Trust | null>(null)
  const judged = identifiability.jobs.length > 1
  const withVerdict = identifiability.parameters.filter(
    (p) => !judged || trust === null || p.trust === trust,
  )
  const shown: readonly FittedParameter[] = matching(withVerdict, text, ({ name }) =>
    name.replaceAll('_', ' '),
  )
  const categorical = shown.filter(isCategorical)
  const others = shown.filter((parameter) => !isCategorical(parameter))
  return (
    <>
      <Verdicts
        identifiability={identifiability}
        chosen={judged ? trust : null}
        onChoose={setTrust}
        text={text}
        onText={setText}
      />
      {shown.length === 0 ? (
        <section class="card">
          <Empty title="No matching parameters">
            <button
              type="button"
              onClick={() => {
                setText('')
                setTrust(null)
              }}
            >
              Show all parameters
            </button>
          </Empty>
        </section>
      ) : (
        <div class="fitted">
          <ParametersTable
            identifiability={identifiability}
            shown={shown}
            labels={labels}
            agreement={agreementOf(job.kind)}
          />
          {categorical.length > 0 && (
            <ChoicesCard shown={categorical} labels={labels} unit={fitnessUnit(job)} />
          )}
          {others.length > 0 && (
            <IntervalPanels
              identifiability={identifiability}
              shown={others}
              labels={labels}
              judgedAt={job.kind === 'calibration' ? null : DECISIVE}
            />
          )}
        </div>
      )}
    </>
  )
}
