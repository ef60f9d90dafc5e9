/** Result of a job: verdict, scenarios, convergence, best design. */

import type { Job, JobSpec, Preference } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { EmptyCard } from '../../components/card'
import { Table } from '../../components/table/table'
import { BrokenName } from '../../components/text'
import { formatExact, formatNumber, NONE, percent, quantity } from '../../format/number'
import { placeWord } from '../../format/place'
import { exactValueQuantity } from '../../format/value'
import { inWords } from '../../format/words'
import { lazyPage } from '../../router/lazy-page'
import { withQuery } from '../../router/routes'
import { VARIABLE } from '../columns'
import { searchedVariables } from '../facts'
import type { PanelProps } from '../page'
import { type Analysis, analyse, type Factor } from '../preference'
import { amountOf, type Quantity, quantityOf } from '../quantity'
import { ConvergenceChart } from './convergence-chart'
import { Hero } from './hero'
import { type WinnerVariable, winnerVariables } from './model'
import './result.css'

const CertificatePanel = lazyPage('the certificate', () => import('../certificate/panel'))
const CandidatesPanel = lazyPage('the candidates', () => import('../candidates/panel'))
const ScenariosPanel = lazyPage('the scenarios', () => import('../scenarios/panel'))
const TargetsPanel = lazyPage('the targets', () => import('../targets/panel'))

export function ResultPanel({ live, job, gain }: PanelProps) {
  const { iterations } = live.followed
  if (job.kind === 'certificate') return <CertificatePanel job={job} />
  if (iterations.length === 0) {
    return (
      <EmptyCard title={job.state === 'queued' ? 'Waiting for a runner' : 'No iteration yet'}>
        {job.state === 'queued'
          ? 'The job starts when a runner has capacity; this page updates automatically.'
          : 'The first iteration appears here once it is committed.'}
      </EmptyCard>
    )
  }
  return (
    <div class="stack">
      {job.kind === 'tuning' && <Hero job={job} gain={gain} />}
      {job.kind === 'calibration' && <TargetsPanel job={job} />}
      {job.kind === 'preferences' && <CandidatesPanel job={job} />}
      <ConvergenceChart job={job} iterations={iterations} reference={gain.reference} />
      {job.best && (
        <>
          {job.kind !== 'preferences' && (
            <ScenariosPanel job={job} own={job.reference ?? gain.verdict?.reference ?? null} />
          )}
          <WinnerCard job={job} />
          {job.spec.kind === 'tuning' && !job.spec.worlds && (
            <LimitsCard job={job} spec={job.spec} />
          )}
        </>
      )}
    </div>
  )
}

function WinnerCard({ job }: { job: Job }) {
  const best = job.best!
  const rows = winnerVariables(best.design, searchedVariables(job.spec))
  const atBound = rows.filter(({ at }) => at !== null)
  const place = { job: job.id, iteration: best.iteration, particle: best.particle }
  return (
    <ChartCard
      title="Best design"
      note={`Design ${placeWord(best)}. Bars show the search ranges.${
        atBound.length > 0 ? ` At a bound: ${atBound.map(({ name }) => name).join(', ')}.` : ''
      }`}
      tools={
        job.kind === 'tuning' && (
          <>
            <a class="button compact" href={withQuery('/walk', place)}>
              Show replay
            </a>
            <a class="button compact" href={withQuery('/controller', place)}>
              Show controller
            </a>
          </>
        )
      }
      table={() => (
        <Table<WinnerVariable>
          caption="Best design and search bounds"
          rows={rows}
          pageSize={60}
          columns={[
            VARIABLE,
            {
              key: 'value',
              numeric: true,
              value: ({ value }) => value,
              cell: ({ value, unit }) => exactValueQuantity(value, unit),
            },
            {
              key: 'from',
              numeric: true,
              value: ({ low }) => low,
              cell: ({ low }) => formatExact(low),
            },
            {
              key: 'to',
              numeric: true,
              value: ({ high }) => high,
              cell: ({ high }) => formatExact(high),
            },
            { key: 'position in range', percent: 3, value: ({ share }) => share },
            { key: 'bound', value: ({ at, fixed }) => (fixed ? 'fixed' : (at ?? NONE)) },
          ]}
        />
      )}
    >
      <dl class="design" data-active-bounds={atBound.map(({ name }) => name).join(' ')}>
        {rows.map((row) => (
          <div key={row.name}>
            <dt>
              <BrokenName name={row.name} />
            </dt>
            <dd>{exactValueQuantity(row.value, row.unit)}</dd>
            <dd class="in-bounds">
              {row.share === null ? (
                <span class="muted small">{row.fixed ? 'fixed' : 'categorical'}</span>
              ) : (
                <RangeBar row={row} />
              )}
            </dd>
          </div>
        ))}
      </dl>
    </ChartCard>
  )
}

function RangeBar({ row }: { row: WinnerVariable }) {
  return (
    <>
      <div
        class="range-bar"
        role="img"
        aria-label={positionInWords(row)}
        data-at={row.at ?? undefined}
      >
        <i style={{ width: `${100 * row.share!}%` }} />
        <b style={{ left: `${100 * row.share!}%` }} />
      </div>
      <span class="range-ends muted small" aria-hidden="true">
        <span>{formatExact(row.low, 4)}</span>
        {row.at !== null && <strong>at bound</strong>}
        <span>{formatExact(row.high, 4)}</span>
      </span>
    </>
  )
}

function positionInWords({ low, high, share, at }: WinnerVariable): string {
  const range = `of the range from ${formatExact(low)} to ${formatExact(high)}`
  return `at ${percent(share, 3)} ${range}${at === null ? '' : `, at the ${at === 'low' ? 'lower' : 'upper'} bound`}`
}

function LimitsCard({ job, spec }: { job: Job; spec: JobSpec }) {
  // A stored spec has its presets resolved.
  const analysis = job.best && analyse(job.best.scenarios, spec.preference as Preference)
  if (!analysis) return null
  const shownOf = ({ objective: name, value }: Factor) => {
    const objective = job.objectives.find((each) => each.name === name)
    const shown = quantityOf(objective ?? { name, unit: '1' })
    return { ...shown, amount: amountOf({ objectives: { [name]: value } }, shown) }
  }
  // A sensitivity to the objective is the opposite of one to its reciprocal.
  const sensitivity = (f: Factor) => (shownOf(f).more ? -f.sensitivity : f.sensitivity)
  return (
    <ChartCard
      title="Limiting factors"
      table={() => (
        <Table<Factor>
          caption="Limiting factors"
          rows={analysis.factors}
          order={{ column: 'sensitivity', descending: true }}
          columns={[
            { key: 'scenario', header: true, value: (f) => f.scenario },
            { key: 'objective', value: (f) => inWords(shownOf(f).name) },
            { key: 'value', digits: 4, value: (f) => shownOf(f).amount },
            { key: 'unit', value: (f) => shownOf(f).unit },
            {
              key: 'contribution to log utility',
              digits: 3,
              value: (f) => f.contribution,
            },
            {
              key: 'sensitivity',
              label: 'Sensitivity of the fitness',
              numeric: true,
              value: (f) => f.sensitivity,
              data: sensitivity,
              cell: (f) => formatNumber(sensitivity(f), 3),
            },
          ]}
        />
      )}
    >
      <div class="stack">
        <p data-limit={`${analysis.worstScenario} ${analysis.worstFactor.objective}`}>
          {explain(analysis, shownOf)}
        </p>
        {Object.keys(analysis.utilities).length > 1 && <ContributionTable analysis={analysis} />}
      </div>
    </ChartCard>
  )
}

function explain(
  { worstScenario, worstFactor, excess, factors, utilities }: Analysis,
  shownOf: (factor: Factor) => Quantity & { amount: number | null },
) {
  const steepest = factors.reduce((a, b) => (b.sensitivity > a.sensitivity ? b : a))
  const [worst, best] = [shownOf(worstFactor), shownOf(steepest)]
  const gain = 1 - (best.more ? 1 / 1.1 : 0.9) ** steepest.sensitivity
  const several = Object.keys(utilities).length > 1
  return (
    <>
      {several && (
        <>
          Scenario <strong>{worstScenario}</strong> limits the winner most: its utility is{' '}
          {formatNumber(excess, 3)} times the geometric mean of all scenarios, mainly because of{' '}
          <strong>{inWords(worst.name)}</strong> ({quantity(worst.amount, worst.unit)}).{' '}
        </>
      )}
      The most effective improvement is in {inWords(best.name)} of {steepest.scenario}:{' '}
      {best.more ? 'raising' : 'reducing'} it by 10&nbsp;% lowers the fitness by about{' '}
      {percent(gain, 2)}.
    </>
  )
}

/** Contribution of each objective to a scenario's utility relative to the mean; rows add up. */
function ContributionTable({ analysis: { factors, utilities } }: { analysis: Analysis }) {
  const objectives = [...new Set(factors.map((f) => f.objective))]
  const most = Math.max(...factors.map((f) => Math.abs(f.contribution)))
  const contribution = (scenario: string, objective: string) =>
    factors.find((f) => f.scenario === scenario && f.objective === objective)?.contribution ?? null
  return (
    <div>
      <Table<string>
        caption="Contributions of the objectives to the logarithm of a scenario’s relative utility"
        rows={Object.keys(utilities)}
        order={{ column: 'sum', descending: true }}
        columns={[
          { key: 'scenario', header: true, value: (s) => s },
          ...objectives.map((objective) => ({
            key: objective,
            label: inWords(quantityOf({ name: objective, unit: '1' }).name),
            numeric: true,
            value: (s: string) => contribution(s, objective),
            cell: (s: string) => <Share value={contribution(s, objective)} most={most} />,
          })),
          {
            key: 'sum',
            numeric: true,
            value: (s) => utilities[s],
            cell: (s) => <strong>{formatNumber(utilities[s], 3)}</strong>,
          },
        ]}
      />
      <p class="muted small table-note">
        Each number is e ln((b + f) / geometric mean of b + f over the scenarios), where f of the
        speed is the time per metre; less is better. A sum is the logarithm of the scenario’s
        utility over the geometric mean of all.
      </p>
    </div>
  )
}

function Share({ value, most }: { value: number | null; most: number }) {
  if (value === null) return <>{NONE}</>
  return (
    <span class="share" data-negative={value < 0}>
      <i style={{ width: `${(Math.abs(value) / most) * 100}%` }} aria-hidden="true" />
      <span>{formatNumber(value, 3)}</span>
    </span>
  )
}
