/** Which fitted parameters can be trusted: how far runs of the same problem agree (fig. 2.14). */

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
import { isComputed } from '../state'
import { ChoicesCard } from './choices-card'
import { IntervalPanels } from './interval-panels'
import { DECISIVE, isCategorical, type Trust } from './intervals'
import './parameters.css'
import { ParametersTable } from './parameters-table'
import { RunPicker } from './run-picker'
import { labelsOf, runsOf, wordOfRuns } from './runs'
import { Verdicts } from './verdicts'

/** How often the parameters of a job that runs are asked for again [ms]. */
const RENEW_MS = 15_000

/** Share of the designs, or distance from the best design, within which runs must agree. */
function agreementOf(kind: Job['kind']): string {
  return kind === 'calibration'
    ? 'among designs whose sum of squared differences, in tolerances, exceeds that of their run’s' +
        ' best by 4 at most'
    : 'at 5 %'
}

export function ParametersPanel({ job }: { job: Job }) {
  const { query } = usePlace()
  if (!job.best) {
    return (
      <section class="card">
        <Empty title="No parameters yet">
          <p>
            No set of parameters has walked through every {caseWords(job.kind).one} so far. The
            first one that does appears here.
          </p>
        </Empty>
      </section>
    )
  }
  return <Fitted job={job} also={runsOf(query, job.id)} />
}

function Fitted({ job, also }: { job: Job; also: readonly string[] }) {
  const key = [job.id, ...also].join()
  const found = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/parameters', {
      path: { job_id: job.id },
      query: { also: [...also] },
      signal,
    }),
  )
  const runs = useResource(key, (signal) => Promise.all(also.map((id) => readableJob(id, signal))))
  usePolling(found.reload, RENEW_MS, isComputed(job))
  const choose = (ids: readonly string[]) => setQuery({ also: wordOfRuns(ids) })
  const compared = [job, ...(runs.data ?? [])]
  return (
    <div class="stack">
      <RunPicker job={job} runs={compared} also={also} onChoose={choose} />
      {found.error && (
        <>
          <ErrorNotice
            what="These runs cannot be compared."
            error={found.error}
            retry={isMissing(found.error) ? undefined : found.reload}
          />
          {also.length > 0 && (
            <p class="row">
              <button type="button" onClick={() => choose([])}>
                Leave the other runs out
              </button>
              <span class="muted">
                Or take out of the list above what does not belong here or has no parameters yet.
              </span>
            </p>
          )}
        </>
      )}
      {!found.data && found.loading && <Loading what="all designs of these runs" />}
      {found.data && (
        <Parameters job={job} found={found.data} labels={labelsOf(found.data.jobs, compared)} />
      )}
    </div>
  )
}

/** A job that is not there will not come. */
function isMissing(error: Error): boolean {
  return error instanceof ApiProblem && error.status === 404
}

function Parameters({
  job,
  found,
  labels,
}: {
  job: Job
  found: Identifiability
  labels: readonly string[]
}) {
  const [text, setText] = useState('')
  const [trust, setTrust] = useState<Trust | null>(null)
  const judged = found.jobs.length > 1
  const wanted = found.parameters.filter((p) => !judged || trust === null || p.trust === trust)
  const shown: readonly FittedParameter[] = matching(wanted, text, ({ name }) =>
    name.replaceAll('_', ' '),
  )
  const categorical = shown.filter(isCategorical)
  const others = shown.filter((parameter) => !isCategorical(parameter))
  return (
    <>
      <Verdicts
        found={found}
        chosen={judged ? trust : null}
        onChoose={setTrust}
        text={text}
        onText={setText}
      />
      {shown.length === 0 ? (
        <section class="card">
          <Empty title="No parameter fits the filter">
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
            found={found}
            shown={shown}
            labels={labels}
            agreement={agreementOf(job.kind)}
          />
          {categorical.length > 0 && (
            <ChoicesCard shown={categorical} labels={labels} unit={fitnessUnit(job)} />
          )}
          {others.length > 0 && (
            <IntervalPanels
              found={found}
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
