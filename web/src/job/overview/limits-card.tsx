/** Factors that limit the winner. */

import type { Job, JobSpec, Preference } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { Table } from '../../components/table/table'
import { formatNumber, percent, quantity } from '../../format/number'
import { inWords } from '../../format/words'
import { type Analysis, analyse, type Factor } from '../preference'

export function LimitsCard({ job, spec }: { job: Job; spec: JobSpec }) {
  // A stored spec has its presets resolved.
  const analysis = job.best && analyse(job.best.scenarios, spec.preference as Preference)
  if (!analysis) return null
  const units = new Map(job.objectives.map((o) => [o.name, o.unit]))
  return (
    <ChartCard
      title="Limiting factors"
      table={() => <FactorTable analysis={analysis} units={units} />}
    >
      <div class="stack">
        <p data-limit={`${analysis.worstScenario} ${analysis.worstFactor.objective}`}>
          {explain(analysis, units)}
        </p>
        {Object.keys(analysis.utilities).length > 1 && <ContributionTable analysis={analysis} />}
      </div>
    </ChartCard>
  )
}

function explain(
  { worstScenario, worstFactor, excess, factors, utilities }: Analysis,
  units: Map<string, string>,
) {
  const steepest = factors.reduce((a, b) => (b.sensitivity > a.sensitivity ? b : a))
  const value = quantity(worstFactor.value, units.get(worstFactor.objective) ?? '1')
  const gain = 1 - (1 - 0.1) ** steepest.sensitivity
  const several = Object.keys(utilities).length > 1
  return (
    <>
      {several && (
        <>
          Scenario <strong>{worstScenario}</strong> limits the winner most: its utility is{' '}
          {formatNumber(excess, 3)} times the geometric mean of all scenarios, mainly because of{' '}
          <strong>{inWords(worstFactor.objective)}</strong> ({value}).{' '}
        </>
      )}
      The most effective improvement is in {inWords(steepest.objective)} of {steepest.scenario}:
      reducing it by 10&nbsp;% lowers the fitness by about {percent(gain, 2)}.
    </>
  )
}

/** Contribution of each objective to a scenario's utility relative to the mean; rows add up. */
function ContributionTable({ analysis }: { analysis: Analysis }) {
  const scenarios = Object.keys(analysis.utilities)
  const objectives = [...new Set(analysis.factors.map((f) => f.objective))]
  const most = Math.max(...analysis.factors.map((f) => Math.abs(f.contribution)))
  const factor = (scenario: string, objective: string) =>
    analysis.factors.find((f) => f.scenario === scenario && f.objective === objective) ?? null
  return (
    <div>
      <Table
        caption="Contributions of the objectives to the logarithm of a scenario’s relative utility"
        rows={scenarios}
        rowKey={(scenario) => scenario}
        order={{ column: 'sum', descending: true }}
        columns={[
          { key: 'scenario', label: 'Scenario', header: true, value: (s) => s },
          ...objectives.map((objective) => ({
            key: objective,
            label: inWords(objective),
            numeric: true,
            value: (s: string) => factor(s, objective)?.contribution ?? null,
            cell: (s: string) => <Share factor={factor(s, objective)} most={most} />,
          })),
          {
            key: 'sum',
            label: 'Sum',
            numeric: true,
            value: (s) => analysis.utilities[s],
            cell: (s) => <strong>{formatNumber(analysis.utilities[s], 3)}</strong>,
          },
        ]}
      />
      <p class="muted small table-note">
        Each number is e ln((b + f) / geometric mean of b + f over the scenarios). A sum is the
        logarithm of the scenario’s utility over the geometric mean of all.
      </p>
    </div>
  )
}

/** Value, contribution and sensitivity of every objective in every scenario. */
function FactorTable({ analysis, units }: { analysis: Analysis; units: Map<string, string> }) {
  return (
    <Table
      caption="Limiting factors"
      rows={analysis.factors}
      rowKey={({ scenario, objective }) => `${scenario} ${objective}`}
      order={{ column: 'sensitivity', descending: true }}
      columns={[
        { key: 'scenario', label: 'Scenario', header: true, value: (f) => f.scenario },
        { key: 'objective', label: 'Objective', value: (f) => inWords(f.objective) },
        {
          key: 'value',
          label: 'Value',
          numeric: true,
          value: (f) => f.value,
          cell: (f) => formatNumber(f.value, 4),
        },
        { key: 'unit', label: 'Unit', value: (f) => units.get(f.objective) ?? '1' },
        {
          key: 'contribution',
          label: 'Contribution to log utility',
          numeric: true,
          value: (f) => f.contribution,
          cell: (f) => formatNumber(f.contribution, 3),
        },
        {
          key: 'sensitivity',
          label: 'Sensitivity of the fitness',
          numeric: true,
          value: (f) => f.sensitivity,
          cell: (f) => formatNumber(f.sensitivity, 3),
        },
      ]}
    />
  )
}

function Share({ factor, most }: { factor: Factor | null; most: number }) {
  if (factor === null) return <>–</>
  const width = (Math.abs(factor.contribution) / most) * 100
  return (
    <span class="share" data-negative={factor.contribution < 0}>
      <i style={{ width: `${width}%` }} aria-hidden="true" />
      <span>{formatNumber(factor.contribution, 3)}</span>
    </span>
  )
}
