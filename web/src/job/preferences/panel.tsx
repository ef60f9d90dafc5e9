/** What-if analysis: ranking of a job's history under another preference, without simulation. */

import { get, post } from '../../api/client'
import { useResource } from '../../api/resource'
import type {
  Job,
  JobSpec,
  Preference,
  PreferencePreset,
  RankedDesign,
  Ranking,
  Variable,
} from '../../api/types'
import { Card, EmptyCard } from '../../components/card'
import { ErrorNotice, Loading } from '../../components/feedback'
import { NumberField, Segmented } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { change, formatCount, formatNumber, NONE, writtenUnit } from '../../format/number'
import { placeWord } from '../../format/place'
import { type Design, formatValue } from '../../format/value'
import { inWords } from '../../format/words'
import { useQueryValue } from '../../router/query-value'
import { withQuery } from '../../router/routes'
import { IterationChart } from '../by-iteration'
import { DesignLink, designColumn } from '../columns'
import { searchedVariables } from '../facts'
import { preferenceOf, preferenceQuery, weighed } from '../preference'
import './what-if.css'

/** Range of the sliders, extended to the current value; fields accept any value that the API accepts. */
const REACH = 2

/** Pause while a slider is moved [ms]. */
const PAUSE_MS = 50

export default function PreferencesPanel({ job }: { job: Job }) {
  const jobPreference = (job.spec as JobSpec).preference as Preference
  const codec = {
    read: preferenceOf,
    write: (preference: Preference) =>
      isSame(preference, jobPreference) ? null : preferenceQuery(preference),
  }
  const [preference, setPreference] = useQueryValue('preference', codec, jobPreference)
  const { data: ranking, error } = useResource(
    `${job.iterations} ${preferenceQuery(preference)}`,
    (signal) =>
      post('/v1/jobs/{job_id}/ranking', {
        path: { job_id: job.id },
        body: { preference, top: 20 },
        signal,
      }),
    { keep: true, pause: PAUSE_MS },
  )
  const presets = useResource('preferences', (signal) =>
    get('/v1/preferences', { signal }).then((answer) => answer.items),
  )
  return (
    <div class="what-if">
      <PreferenceSliders
        job={job}
        preference={preference}
        jobPreference={jobPreference}
        presets={presets.data ?? []}
        onChange={setPreference}
      />
      <div class="stack" aria-live="polite">
        {error !== null && <ErrorNotice what="Could not rank the designs." error={error} />}
        {ranking ? (
          <RankingResult job={job} ranking={ranking} preference={preference} />
        ) : (
          error === null && <Loading what="the ranking" />
        )}
      </div>
    </div>
  )
}

function isSame(a: Preference, b: Preference): boolean {
  return preferenceQuery(a) === preferenceQuery(b)
}

/** Sliders for biases and exponents, and a choice of published preferences. */
function PreferenceSliders({
  job,
  preference,
  jobPreference,
  presets,
  onChange,
}: {
  job: Job
  preference: Preference
  jobPreference: Preference
  presets: readonly PreferencePreset[]
  onChange: (preference: Preference) => void
}) {
  const offered: readonly (readonly [name: string, preference: Preference])[] = [
    ['job’s preference', jobPreference],
    ...presets.map((preset) => [preset.name, preset] as const),
  ]
  const weight = (part: 'bias' | 'exponent', objective: string, index: number) => {
    const value = preference[part][index]
    const unit = job.objectives.find(({ name }) => name === objective)?.unit ?? '1'
    const name = `${part} of ${inWords(objective)}`
    const set = (next: number) => {
      if (!Number.isFinite(next) || next < 0) return
      const values = preference[part].map((old, k) => (k === index ? next : old))
      onChange({ ...preference, [part]: values } as Preference)
    }
    return (
      <div class="weight">
        <span aria-hidden="true">{part === 'bias' ? 'b' : 'e'}</span>
        <input
          type="range"
          min={0}
          max={Math.max(REACH, value)}
          step={0.01}
          value={value}
          aria-label={name}
          onInput={(event) => set(event.currentTarget.valueAsNumber)}
        />
        <NumberField
          label={`${name}, number`}
          value={Number(value.toPrecision(6))}
          min={0}
          step={0.01}
          onChange={(text) => set(text === '' ? Number.NaN : Number(text))}
        />
        <span class="unit">{part === 'bias' && unit !== '1' && writtenUnit(unit)}</span>
      </div>
    )
  }
  return (
    <Card title="Preference">
      <div class="stack">
        <p class="muted small">
          A scenario’s utility is the product of (b + f)<sup>e</sup> over the objectives f. A larger
          e increases the weight of an objective; a larger b reduces the influence of small values.
        </p>
        <Segmented
          label="Published preferences"
          value={offered.flatMap(([name, each]) => (isSame(preference, each) ? [name] : []))}
          options={offered.map(([name]) => [name, name] as const)}
          onChoose={(name) => {
            const { bias, exponent } = offered.find(([each]) => each === name)![1]
            onChange({ bias, exponent })
          }}
        />
        {weighed(preference).map((objective, index) => (
          <fieldset key={objective}>
            <legend>{inWords(objective)}</legend>
            {weight('bias', objective, index)}
            {weight('exponent', objective, index)}
          </fieldset>
        ))}
      </div>
    </Card>
  )
}

interface RankingResultProps {
  job: Job
  ranking: Ranking
  preference: Preference
}

function RankingResult({ job, ranking, preference }: RankingResultProps) {
  const [winner] = ranking.top
  if (!winner) {
    return (
      <EmptyCard title="Nothing to rank yet">
        No design has succeeded in every scenario yet.
      </EmptyCard>
    )
  }
  return (
    <>
      <Winners job={job} ranking={ranking} winner={winner} preference={preference} />
      <Card title="Best designs under this preference">
        <Table<RankedDesign>
          caption="Best designs under this preference"
          rows={ranking.top}
          columns={[
            { key: 'rank', numeric: true, value: (d) => d.rank },
            {
              key: 'previous rank',
              numeric: true,
              value: (d) => d.rank_before,
              cell: ({ rank, rank_before }) => {
                if (rank_before === null) return NONE
                const steps = rank_before - rank
                const move = `${steps > 0 ? 'up' : 'down'} ${formatCount(Math.abs(steps))}`
                return (
                  <>
                    {formatCount(rank_before)}
                    {steps !== 0 && <span class="muted small"> ({move})</span>}
                  </>
                )
              },
            },
            designColumn(job, true),
            { key: 'fitness', digits: 5, value: (d) => d.fitness },
            { key: 'previous fitness', digits: 5, value: (d) => d.fitness_before },
          ]}
        />
      </Card>
      <IterationChart
        title="Best so far under this preference"
        note={lastGain(ranking)}
        label="Best fitness so far under this preference by iteration"
        rows={ranking.best_so_far}
        name="best so far"
        yLabel="fitness"
        value={({ fitness }) => fitness}
        logarithmic
        height={220}
      />
    </>
  )
}

function Winners({
  job,
  ranking: { fitness_of_present_best: old, evaluations, correlation },
  winner,
  preference,
}: {
  job: Job
  ranking: Ranking
  winner: RankedDesign
  preference: Preference
}) {
  const { iteration, particle, fitness } = winner
  const stays = job.best && placeWord(job.best) === placeWord(winner)
  const link = <DesignLink job={job} iteration={iteration} particle={particle} />
  return (
    <Card
      title={stays ? 'Same winner' : 'New winner'}
      data={{ 'data-winner': placeWord(winner), 'data-evaluations': evaluations }}
      tools={
        <a
          class="button primary compact"
          href={withQuery('/jobs/new', {
            clone: job.id,
            preference: preferenceQuery(preference),
            iteration,
            particle,
          })}
        >
          Start a job from here
        </a>
      }
    >
      <p>
        {stays ? (
          <>
            {link} is also the best under this preference, with a fitness of{' '}
            {formatNumber(fitness, 5)}.
          </>
        ) : (
          <>
            {link} has a fitness of <strong>{formatNumber(fitness, 5)}</strong>
            {old !== null && (
              <> ({change((fitness / old - 1) * 100, '%')} relative to the job’s winner)</>
            )}
            . Under the job’s preference, its rank is {formatCount(winner.rank_before)}.
          </>
        )}
      </p>
      <p class="muted small">
        {formatCount(evaluations)} designs ranked; rank correlation with the job’s preference:{' '}
        {formatNumber(correlation, 3)}.
      </p>
      {!stays && (
        <Table
          caption="Designs of the new winner and of the job's winner"
          rows={searchedVariables(job.spec)}
          columns={changeColumns(job.best?.design ?? {}, winner.design)}
        />
      )}
    </Card>
  )
}

function changeColumns(before: Design, now: Design): readonly Column<Variable>[] {
  return [
    { key: 'variable', header: true, cell: (v) => v.name },
    { key: 'job’s winner', numeric: true, cell: (v) => formatValue(before[v.name]) },
    { key: 'new winner', numeric: true, cell: (v) => formatValue(now[v.name]) },
    { key: 'unit', cell: (v) => (v.unit === '1' ? NONE : v.unit) },
    {
      key: 'change',
      unit: '% of range',
      numeric: true,
      cell: (v) => {
        const [from, to] = [before[v.name], now[v.name]]
        if (typeof from !== 'number' || typeof to !== 'number') return NONE
        return change(((to - from) / (v.high - v.low)) * 100, '1', 2)
      },
    },
  ]
}

/** Iteration of the best; a late improvement alone does not predict further ones. */
function lastGain({ best_so_far: points }: Ranking): string {
  const best = points.at(-1)?.fitness ?? null
  if (best === null) return 'No design succeeds in every scenario.'
  const index = points.findIndex(({ fitness }) => fitness === best)
  const since = points.length - 1 - index
  const after = since === 0 ? 'the last one' : `no improvement in the ${since} iterations after it`
  return `The best is from iteration ${points[index].index}; ${after}.`
}
