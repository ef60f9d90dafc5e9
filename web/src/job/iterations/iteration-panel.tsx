/** Designs of one iteration, with links to their simulations and controllers. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Evaluation, Job } from '../../api/types'
import { ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatNumber } from '../../format/number'
import { formatValue } from '../../format/value'
import { PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { jobPath, withQuery } from '../../router/routes'
import { searchedVariables } from '../designs/variables'
import { caseWords, fitnessUnit } from '../fitness'
import { canFork, ForkButton } from '../header/fork-dialog'

export function IterationPanel({ job, index }: { job: Job; index: number }) {
  const evaluations = useResource(`${job.id} ${index}`, (signal) =>
    get('/v1/jobs/{job_id}/iterations/{iteration}/evaluations', {
      path: { job_id: job.id, iteration: index },
      signal,
    }).then((answer) => answer.items),
  )
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <section class="card" aria-labelledby="designs">
      <header class="row spread">
        <h2 id="designs">Designs of iteration {index}</h2>
        <nav class="row" aria-label="Other iterations">
          {canFork(job, index + 1) && <ForkButton job={job} from={index + 1} compact />}
          <a class="button compact" href={jobPath(job.id, 'iterations')}>
            All iterations
          </a>
          {index > 0 && (
            <a class="button compact" href={jobPath(job.id, `iterations/${index - 1}`)}>
              Previous
            </a>
          )}
          {index + 1 < job.iterations && (
            <a class="button compact" href={jobPath(job.id, `iterations/${index + 1}`)}>
              Next
            </a>
          )}
        </nav>
      </header>
      {evaluations.error && (
        <ErrorNotice
          what="Could not load the designs."
          error={evaluations.error}
          retry={evaluations.reload}
        />
      )}
      {evaluations.loading && !evaluations.data && <Loading what="designs" />}
      {evaluations.data && (
        <Table
          caption={`Designs of iteration ${index}`}
          rows={evaluations.data}
          rowKey={(e) => String(e.particle)}
          paging={paging}
          order={{ column: 'fitness', descending: false }}
          columns={columns(job)}
          rowData={(e) => ({ 'data-particle': e.particle })}
        />
      )}
    </section>
  )
}

function columns(job: Job): readonly Column<Evaluation>[] {
  const tuning = job.kind === 'tuning'
  const unit = fitnessUnit(job)
  return [
    {
      key: 'particle',
      label: 'Design',
      header: true,
      value: (e) => e.particle,
      cell: (e) => (tuning ? <a href={walkOf(job, e)}>{e.particle}</a> : e.particle),
    },
    {
      key: 'fitness',
      label: 'Fitness',
      unit,
      numeric: true,
      value: (e) => e.fitness,
      cell: (e) => (e.fitness === null ? <Failure evaluation={e} /> : formatNumber(e.fitness, 5)),
    },
    ...searchedVariables(job.spec).map(
      (variable): Column<Evaluation> => ({
        key: `design ${variable.name}`,
        label: variable.name,
        unit: variable.unit,
        numeric: variable.kind !== 'categorical',
        value: (e) => e.design[variable.name] ?? null,
        cell: (e) => formatValue(e.design[variable.name], variable.kind === 'integer' ? 1 : 4),
      }),
    ),
    ...scenarioNames(job).map(
      (scenario): Column<Evaluation> => ({
        key: `utility ${scenario}`,
        label: `${caseWords(job.kind).measure} ${scenario}`,
        unit,
        numeric: true,
        value: (e) => e.scenarios[scenario]?.utility ?? null,
        cell: (e) => <UtilityCell job={job} evaluation={e} scenario={scenario} />,
      }),
    ),
    ...(tuning
      ? [
          {
            key: 'controller',
            label: 'Controller',
            cell: (e: Evaluation) => (
              <a href={withQuery('/controller', placeOf(job, e))}>surface</a>
            ),
          },
        ]
      : []),
  ]
}

function UtilityCell({
  job,
  evaluation,
  scenario,
}: {
  job: Job
  evaluation: Evaluation
  scenario: string
}) {
  const result = evaluation.scenarios[scenario]
  if (!result) return <>–</>
  const shown = result.utility === null ? result.status : formatNumber(result.utility)
  if (job.kind !== 'tuning') return <>{shown}</>
  return (
    <a href={walkOf(job, evaluation, scenario)} title={result.explanation}>
      {shown}
    </a>
  )
}

function Failure({ evaluation }: { evaluation: Evaluation }) {
  const failed = Object.values(evaluation.scenarios).find((result) => result.status !== 'ok')
  return <span class="wrong">{failed?.status ?? 'no fitness'}</span>
}

function scenarioNames(job: Job): readonly string[] {
  return job.scenarios
}

function placeOf(job: Job, { iteration, particle }: Evaluation) {
  return { job: job.id, iteration, particle }
}

function walkOf(job: Job, evaluation: Evaluation, scenario?: string): string {
  const name = scenario ?? scenarioNames(job)[0]
  return withQuery('/walk', { ...placeOf(job, evaluation), scenario: name })
}
