/** Factors that limit the winner. */

import type { Job, JobSpec, Preference } from '../../api/types'
import { ChartCard } from '../../charts/chart-card'
import { Table } from '../../components/table/table'
import { formatNumber, NONE, percent, quantity } from '../../format/number'
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
      table={() => (
        <Table<Factor>
          caption="Limiting factors"
          rows={analysis.factors}
          order={{ column: 'sensitivity', descending: true }}
          columns={[
            { key: 'scenario', header: true, value: (f) => f.scenario },
            { key: 'objective', value: (f) => inWords(f.objective) },
            { key: 'value', digits: 4, value: (f) => f.value },
            { key: 'unit', value: (f) => units.get(f.objective) ?? '1' },
            {
              key: 'contribution to log utility',
              digits: 3,
              value: (f) => f.contribution,
            },
            {
              key: 'sensitivity',
              label: 'Sensitivity of the fitness',
              digits: 3,
              value: (f) => f.sensitivity,
            },
          ]}
        />
      )}
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
            label: inWords(objective),
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
        Each number is e ln((b + f) / geometric mean of b + f over the scenarios). A sum is the
        logarithm of the scenario’s utility over the geometric mean of all.
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
