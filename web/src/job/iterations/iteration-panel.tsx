/** Designs of one iteration, with links to their simulations and controllers. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Evaluation, Job } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE } from '../../format/number'
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
    <Card
      title={<>Designs of iteration {index}</>}
      tools={
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
      }
    >
      <Loaded resource={evaluations} what="designs" failed="Could not load the designs.">
        {(rows) => (
          <Table
            caption={`Designs of iteration ${index}`}
            rows={rows}
            rowKey={(e) => String(e.particle)}
            paging={paging}
            order={{ column: 'fitness', descending: false }}
            columns={columns(job)}
            rowData={(e) => ({ 'data-particle': e.particle })}
          />
        )}
      </Loaded>
    </Card>
  )
}

function columns(job: Job): readonly Column<Evaluation>[] {
  const tuning = job.kind === 'tuning'
  const unit = fitnessUnit(job)
  const placeOf = ({ iteration, particle }: Evaluation) => ({ job: job.id, iteration, particle })
  const walkOf = (evaluation: Evaluation, scenario = job.scenarios[0]) =>
    withQuery('/walk', { ...placeOf(evaluation), scenario })
  const controller: Column<Evaluation> = {
    key: 'controller',
    cell: (e) => <a href={withQuery('/controller', placeOf(e))}>surface</a>,
  }
  return [
    {
      key: 'design',
      header: true,
      value: (e) => e.particle,
      cell: (e) => (tuning ? <a href={walkOf(e)}>{e.particle}</a> : e.particle),
    },
    {
      key: 'fitness',
      unit,
      numeric: true,
      value: (e) => e.fitness,
      cell: ({ fitness, scenarios }) => {
        if (fitness !== null) return formatNumber(fitness, 5)
        const failed = Object.values(scenarios).find(({ status }) => status !== 'ok')
        return <span class="wrong">{failed?.status ?? 'no fitness'}</span>
      },
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
    ...job.scenarios.map(
      (scenario): Column<Evaluation> => ({
        key: `utility ${scenario}`,
        label: `${caseWords(job.kind).measure} ${scenario}`,
        unit,
        numeric: true,
        value: (e) => e.scenarios[scenario]?.utility ?? null,
        cell: (e) => {
          const result = e.scenarios[scenario]
          if (!result) return NONE
          const shown = result.utility === null ? result.status : formatNumber(result.utility)
          if (!tuning) return shown
          return (
            <a href={walkOf(e, scenario)} title={result.explanation}>
              {shown}
            </a>
          )
        },
      }),
    ),
    ...(tuning ? [controller] : []),
  ]
}
