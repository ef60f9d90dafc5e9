/** Committed iterations, with filters and downloads, and the designs of one of them. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Evaluation, Iteration, Job } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatNumber, NONE } from '../../format/number'
import { formatMoment } from '../../format/time'
import { formatValue } from '../../format/value'
import { capitalized, inWords } from '../../format/words'
import { type Codec, flag, ORDER, PAGE_NUMBER, useQueryValue } from '../../router/query-value'
import { jobPath, withQuery } from '../../router/routes'
import { caseWords, fitnessUnit, searchedVariables } from '../facts'
import { canFork, ForkButton } from '../header/dialogs'
import type { PanelProps } from '../page'

const NEWEST = { column: 'index', descending: true }

/** A number as typed, or empty. */
const AT_MOST: Codec<string> = {
  read: (text) => (text !== '' && Number.isFinite(Number(text)) ? text : undefined),
  write: (text) => text || null,
}

export default function IterationsPanel({ live, job, detail }: PanelProps) {
  if (detail) return <IterationPanel job={job} index={Number(detail)} />
  return <AllIterations live={live} job={job} />
}

function AllIterations({ live, job }: Pick<PanelProps, 'live' | 'job'>) {
  const { iterations } = live.followed
  const [least, setLeast] = useQueryValue('most', AT_MOST, '')
  const [improved, setImproved] = useQueryValue('improved', flag(false), false)
  const [order, setOrder] = useQueryValue('sort', ORDER, NEWEST)
  const shown = iterations.filter(
    (i) =>
      (least === '' || (i.best !== null && i.best <= Number(least))) &&
      (!improved || isImprovement(iterations, i)),
  )
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <Card
      title="Iterations"
      tools={
        <span class="row">
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=csv`} download>
            Download CSV
          </a>
          <a class="button compact" href={`/v1/jobs/${job.id}/export?format=parquet`} download>
            Download Parquet
          </a>
        </span>
      }
    >
      {iterations.length === 0 ? (
        <Empty title="No iteration yet">
          <p>Iterations appear here as they are committed.</p>
        </Empty>
      ) : (
        <div class="stack">
          <search class="row">
            <label class="row small">
              Best at most
              <input
                type="number"
                step="any"
                class="short"
                value={least}
                onInput={(event) => setLeast(event.currentTarget.value)}
              />
            </label>
            <Check label="only improvements" checked={improved} onChange={setImproved} />
            <span class="muted small" aria-live="polite">
              {shown.length} of {iterations.length}
            </span>
          </search>
          <Table
            caption="Iterations"
            rows={shown}
            rowKey={(i) => String(i.index)}
            paging={paging}
            order={order}
            onOrder={setOrder}
            columns={iterationColumns(job)}
            rowData={(i) => ({ 'data-index': i.index })}
          />
        </div>
      )}
    </Card>
  )
}

function isImprovement(iterations: readonly Iteration[], { index, best_so_far }: Iteration) {
  const before = iterations[index - 1]?.best_so_far ?? null
  return best_so_far !== null && (before === null || best_so_far < before)
}

function iterationColumns(job: Job): readonly Column<Iteration>[] {
  const unit = fitnessUnit(job)
  const fitness = (
    key: 'best' | 'median' | 'mean' | 'worst' | 'best_so_far',
    minor = false,
  ): Column<Iteration> => ({
    key,
    label: capitalized(inWords(key)),
    unit,
    digits: 5,
    minor,
    value: (i) => i[key],
  })
  return [
    {
      key: 'index',
      label: 'Iteration',
      header: true,
      value: (i) => i.index,
      cell: (i) => <a href={jobPath(job.id, `iterations/${i.index}`)}>{i.index}</a>,
    },
    { key: 'designs', numeric: true, minor: true, value: (i) => i.designs },
    fitness('best'),
    fitness('median'),
    fitness('mean', true),
    fitness('worst', true),
    fitness('best_so_far'),
    { key: 'failed', numeric: true, value: (i) => i.failed },
    { key: 'time', unit: 's', digits: 3, minor: true, value: (i) => i.evaluate_seconds },
    {
      key: 'committed',
      minor: true,
      value: (i) => i.committed_at,
      cell: (i) => formatMoment(i.committed_at),
    },
  ]
}

function IterationPanel({ job, index }: { job: Job; index: number }) {
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
      <Loaded resource={evaluations} what="the designs">
        {(rows) => (
          <Table
            caption={`Designs of iteration ${index}`}
            rows={rows}
            rowKey={(e) => String(e.particle)}
            paging={paging}
            order={{ column: 'fitness', descending: false }}
            columns={designColumns(job)}
            rowData={(e) => ({ 'data-particle': e.particle })}
          />
        )}
      </Loaded>
    </Card>
  )
}

function designColumns(job: Job): readonly Column<Evaluation>[] {
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
