/** Fitted parameters: values, and their agreement between runs (fig. 2.14). */

import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { readableJob } from '../../api/jobs'
import { ApiProblem } from '../../api/problem'
import { usePolling, useResource } from '../../api/resource'
import type { FittedParameter, Identifiability, Job } from '../../api/types'
import { Card, EmptyCard } from '../../components/card'
import { ErrorNotice, Loading } from '../../components/feedback'
import { Segmented } from '../../components/fields/controls'
import { matching } from '../../components/table/rows'
import { type Column, Table } from '../../components/table/table'
import { BrokenName } from '../../components/text'
import { formatCount, formatExact, writtenUnit } from '../../format/number'
import { formatValue } from '../../format/value'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { VARIABLE } from '../columns'
import { caseWords, fitnessUnit, isRunning } from '../facts'
import { IntervalPanels, TrustBadge } from './interval-panels'
import { isCategorical, rankOf, type Trust, verdicts, WIDTHS, widthAt } from './intervals'
import { RunPicker } from './run-picker'
import { labelsOf, runsOf } from './runs'
import './parameters.css'

const RENEW_MS = 15_000

export default function ParametersPanel({ job }: { job: Job }) {
  const { query } = usePlace()
  if (!job.best) {
    return (
      <EmptyCard title="No parameters yet">
        {`No parameter set has succeeded in every ${caseWords(job.kind).item} yet. The first one that does appears here.`}
      </EmptyCard>
    )
  }
  return <Fitted job={job} others={runsOf(query, job.id)} />
}

function Fitted({ job, others }: { job: Job; others: readonly string[] }) {
  const key = [job.id, ...others].join()
  const identifiability = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/parameters', {
      path: { job_id: job.id },
      query: { also: [...others] },
      signal,
    }),
  )
  const runs = useResource(key, (signal) =>
    Promise.all(others.map((id) => readableJob(id, signal))),
  )
  usePolling(identifiability.reload, RENEW_MS, isRunning(job))
  const choose = (ids: readonly string[]) => setQuery({ also: ids.join() || null })
  const compared = [job, ...(runs.data ?? [])]
  return (
    <div class="stack">
      <RunPicker job={job} runs={compared} others={others} onSelect={choose} />
      {identifiability.error && (
        <>
          <ErrorNotice
            what="Could not compare these runs."
            error={identifiability.error}
            // A missing job will not appear.
            retry={isMissing(identifiability.error) ? undefined : identifiability.reload}
          />
          {others.length > 0 && (
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

function isMissing(error: Error): boolean {
  return error instanceof ApiProblem && error.status === 404
}

interface ParametersProps {
  job: Job
  identifiability: Identifiability
  labels: readonly string[]
}

function Parameters({ job, identifiability, labels }: ParametersProps) {
  const [text, setText] = useState('')
  const [trust, setTrust] = useState<Trust | null>(null)
  const judged = identifiability.jobs.length > 1
  const shown = matching(
    identifiability.parameters.filter((p) => !judged || trust === null || p.trust === trust),
    text,
    ({ name }) => inWords(name),
  )
  const categorical = shown.filter(isCategorical)
  const others = shown.filter((parameter) => !isCategorical(parameter))
  const showAll = () => {
    setText('')
    setTrust(null)
  }
  return (
    <>
      <Verdicts
        identifiability={identifiability}
        trust={trust}
        onTrust={setTrust}
        text={text}
        onText={setText}
      />
      {shown.length === 0 ? (
        <EmptyCard title="No matching parameters">
          <button type="button" onClick={showAll}>
            Show all parameters
          </button>
        </EmptyCard>
      ) : (
        <div class="fitted">
          <Card
            title="Parameters"
            note={
              <>
                Widths are shares of the search range, among designs with a fitness within 20, 10, 5
                and 2&nbsp;% of their run’s best. Verdicts state the agreement{' '}
                {job.kind === 'calibration'
                  ? 'among designs whose sum of squared differences, in tolerances, exceeds that of their run’s best by at most 4'
                  : 'at 5 %'}
                , not correctness.
              </>
            }
          >
            <Table
              caption="Fitted parameters"
              rows={shown}
              rowKey={({ name }) => name}
              columns={parameterColumns(identifiability, labels)}
              rowData={({ name, trust }) => ({
                'data-parameter': name,
                'data-verdict': trust ?? 'none',
              })}
              pageSize={60}
            />
          </Card>
          {categorical.length > 0 && (
            <ChoicesCard parameters={categorical} labels={labels} unit={fitnessUnit(job)} />
          )}
          {others.length > 0 && (
            <IntervalPanels
              identifiability={identifiability}
              shown={others}
              runs={labels.length}
              judged={job.kind !== 'calibration'}
            />
          )}
        </div>
      )}
    </>
  )
}

interface VerdictsProps {
  identifiability: Identifiability
  trust: Trust | null
  onTrust: (trust: Trust | null) => void
  text: string
  onText: (text: string) => void
}

function Verdicts({ identifiability, trust: selected, onTrust, text, onText }: VerdictsProps) {
  const all = verdicts(identifiability)
  const judged = identifiability.jobs.length > 1
  return (
    <Card class="stack verdict-card" title="Confidence in the parameters">
      {judged ? (
        <dl class="verdicts">
          {all
            .filter(({ count }) => count > 0)
            .map(({ trust, count, explanation }) => (
              <div key={trust} data-verdict={trust} data-count={count}>
                <dt>
                  <TrustBadge trust={trust} /> <strong>{formatCount(count)}</strong>
                </dt>
                <dd>{explanation}</dd>
              </div>
            ))}
        </dl>
      ) : (
        <div class="notice" data-tone="warn" data-single-run>
          <strong>One run is not enough.</strong>
          <p>
            A search converges to some value of every parameter, whether or not the results depend
            on it. Only agreement between runs with different seeds shows that a value can be
            trusted: select other runs above, or run this job with another seed.
          </p>
        </div>
      )}
      <search class="row">
        <label>
          <span class="visually-hidden">Find a parameter</span>
          <input
            type="search"
            placeholder="Find a parameter"
            value={text}
            onInput={(event) => onText(event.currentTarget.value)}
          />
        </label>
        {judged && (
          <Segmented<Trust | 'all'>
            label="Verdict"
            value={selected ?? 'all'}
            options={[
              ['all', `all ${formatCount(identifiability.parameters.length)}`],
              ...all.map(({ trust, count }) => [trust, `${trust} ${formatCount(count)}`] as const),
            ]}
            onChoose={(trust) => onTrust(trust === 'all' ? null : trust)}
          />
        )}
      </search>
    </Card>
  )
}

function parameterColumns(
  identifiability: Identifiability,
  labels: readonly string[],
): readonly Column<FittedParameter>[] {
  const verdict: Column<FittedParameter> = {
    key: 'verdict',
    value: rankOf,
    cell: ({ trust, explanation }) =>
      trust && (
        <span title={explanation ?? undefined}>
          <TrustBadge trust={trust} />
        </span>
      ),
  }
  const byRun = labels.map(
    (label, run): Column<FittedParameter> => ({
      key: `run ${run}`,
      label,
      numeric: true,
      value: (p) => p.bests[run],
      cell: (p) => formatValue(p.bests[run]),
    }),
  )
  return [
    {
      ...VARIABLE,
      label: 'Parameter',
      cell: ({ name }) => (
        <span class="parameter-name">
          <BrokenName name={name} />
        </span>
      ),
    },
    {
      key: 'unit',
      minor: true,
      value: ({ unit }) => (unit === '1' ? '' : unit),
      cell: ({ unit }) => <span class="nowrap">{unit === '1' ? '' : writtenUnit(unit)}</span>,
    },
    ...(labels.length > 1 ? [verdict] : []),
    {
      key: 'best',
      numeric: true,
      value: ({ best }) => best,
      cell: ({ best }) => <strong>{formatValue(best)}</strong>,
    },
    ...WIDTHS.map(
      (threshold): Column<FittedParameter> => ({
        key: `width ${threshold * 100} %`,
        percent: 2,
        value: (p) => widthAt(identifiability, p, threshold),
      }),
    ),
    ...(labels.length > 1 ? byRun : []),
    {
      key: 'search range',
      numeric: true,
      cell: ({ low, high, choices }) =>
        choices.length > 0
          ? choices.map(({ name }) => inWords(name)).join(', ')
          : `${formatExact(low, 3)} – ${formatExact(high, 3)}`,
    },
  ]
}

type Choice = FittedParameter['choices'][number] & { readonly parameter: string }

interface ChoicesCardProps {
  parameters: readonly FittedParameter[]
  labels: readonly string[]
  unit: string
}

function ChoicesCard({ parameters, labels, unit }: ChoicesCardProps) {
  const byRun = labels.map(
    (label, run): Column<Choice> => ({
      key: `run ${run}`,
      label,
      unit,
      digits: 4,
      minor: true,
      value: ({ by_run }) => by_run[run],
    }),
  )
  return (
    <Card
      title="Choices"
      note="Best fitness of all designs with each choice. A choice remains possible if any run has it among the designs considered as good as its best."
    >
      <Table<Choice>
        caption="Best fitness by choice"
        rows={parameters.flatMap(({ name: parameter, choices }) =>
          choices.map((choice) => ({ ...choice, parameter })),
        )}
        columns={[
          {
            key: 'parameter',
            value: ({ parameter }) => parameter,
            cell: ({ parameter }) => <BrokenName name={parameter} />,
          },
          { key: 'choice', header: true, value: ({ name }) => inWords(name) },
          { key: 'best fitness', unit, digits: 4, value: ({ fitness }) => fitness },
          ...(labels.length > 1 ? byRun : []),
          { key: 'possible', value: ({ remains }) => (remains ? 'yes' : 'no') },
        ]}
        rowData={({ parameter, name }) => ({ 'data-choice': `${parameter} ${name}` })}
        pageSize={60}
      />
    </Card>
  )
}
