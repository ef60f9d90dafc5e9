/** Ranking of a job's designs under another preference. */

import { useMemo } from 'preact/hooks'
import type { Job, Preference, RankedDesign, Ranking } from '../../api/types'
import { LineCard } from '../../charts/chart-card'
import { Empty } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { change, formatCount, formatNumber } from '../../format/number'
import { placeWord } from '../../format/place'
import { formatValue } from '../../format/value'
import { withQuery } from '../../router/routes'
import { Where } from '../designs/selected-designs'
import { searchedVariables } from '../designs/variables'
import { preferenceQuery } from '../preference'

export function RankingResult({
  job,
  ranking,
  preference,
}: {
  job: Job
  ranking: Ranking
  preference: Preference
}) {
  const [winner] = ranking.top
  if (!winner) {
    return (
      <section class="card">
        <Empty title="Nothing to rank yet">
          <p>No design has succeeded in every scenario yet.</p>
        </Empty>
      </section>
    )
  }
  return (
    <>
      <Winners job={job} ranking={ranking} winner={winner} preference={preference} />
      <section class="card" aria-labelledby="moves">
        <h2 id="moves">Best designs under this preference</h2>
        <Table
          caption="Best designs under this preference"
          rows={ranking.top}
          rowKey={(d) => `${d.iteration} ${d.particle}`}
          columns={rankColumns(job)}
        />
      </section>
      <BestSoFar ranking={ranking} />
    </>
  )
}

/** Comparison of the new winner with the job's, and a link to start a job from it. */
function Winners({
  job,
  ranking,
  winner,
  preference,
}: {
  job: Job
  ranking: Ranking
  winner: RankedDesign
  preference: Preference
}) {
  const best = job.best
  const stays = best && best.iteration === winner.iteration && best.particle === winner.particle
  const old = ranking.fitness_of_present_best
  const gain = old === null ? null : (winner.fitness / old - 1) * 100
  const target = withQuery('/jobs/new', {
    clone: job.id,
    preference: preferenceQuery(preference),
    iteration: winner.iteration,
    particle: winner.particle,
  })
  return (
    <section
      class="card"
      aria-labelledby="new-winner"
      data-winner={placeWord(winner)}
      data-evaluations={ranking.evaluations}
    >
      <header class="row spread">
        <h2 id="new-winner">{stays ? 'Same winner' : 'New winner'}</h2>
        <a class="button primary compact" href={target}>
          Start a job from here
        </a>
      </header>
      <p>
        {stays ? (
          <>
            <Where job={job} iteration={winner.iteration} particle={winner.particle} /> is also the
            best under this preference, with a fitness of {formatNumber(winner.fitness, 5)}.
          </>
        ) : (
          <>
            <Where job={job} iteration={winner.iteration} particle={winner.particle} /> has a
            fitness of <strong>{formatNumber(winner.fitness, 5)}</strong>
            {gain !== null && <> ({change(gain, '%')} relative to the job’s winner)</>}. Under the
            job’s preference, its rank is {formatCount(winner.rank_before)}.
          </>
        )}
      </p>
      <p class="muted small">
        {formatCount(ranking.evaluations)} designs ranked; rank correlation with the job’s
        preference: {formatNumber(ranking.correlation, 3)}.
      </p>
      {!stays && <DesignChange job={job} winner={winner} />}
    </section>
  )
}

function DesignChange({ job, winner }: { job: Job; winner: RankedDesign }) {
  const variables = searchedVariables(job.spec)
  return (
    <Table
      caption="Designs of the new winner and of the job's winner"
      rows={variables}
      rowKey={(v) => v.name}
      columns={[
        { key: 'name', label: 'Variable', header: true, cell: (v) => v.name },
        {
          key: 'before',
          label: 'Job’s winner',
          numeric: true,
          cell: (v) => formatValue(job.best?.design[v.name]),
        },
        {
          key: 'now',
          label: 'New winner',
          numeric: true,
          cell: (v) => formatValue(winner.design[v.name]),
        },
        { key: 'unit', label: 'Unit', cell: (v) => (v.unit === '1' ? '–' : v.unit) },
        {
          key: 'change',
          label: 'Change',
          unit: '% of range',
          numeric: true,
          cell: (v) => {
            const [before, now] = [job.best?.design[v.name], winner.design[v.name]]
            if (typeof before !== 'number' || typeof now !== 'number') return '–'
            return change(((now - before) / (v.high - v.low)) * 100, '1', 2)
          },
        },
      ]}
    />
  )
}

function rankColumns(job: Job): readonly Column<RankedDesign>[] {
  return [
    { key: 'rank', label: 'Rank', numeric: true, value: (d) => d.rank },
    {
      key: 'before',
      label: 'Previous rank',
      numeric: true,
      value: (d) => d.rank_before,
      cell: (d) => <RankMove design={d} />,
    },
    {
      key: 'design',
      label: 'Design',
      header: true,
      value: (d) => d.iteration,
      cell: (d) => <Where job={job} iteration={d.iteration} particle={d.particle} />,
    },
    {
      key: 'fitness',
      label: 'Fitness',
      numeric: true,
      value: (d) => d.fitness,
      cell: (d) => formatNumber(d.fitness, 5),
    },
    {
      key: 'fitness_before',
      label: 'Previous fitness',
      numeric: true,
      value: (d) => d.fitness_before,
      cell: (d) => formatNumber(d.fitness_before, 5),
    },
  ]
}

function RankMove({ design: { rank, rank_before } }: { design: RankedDesign }) {
  if (rank_before === null) return <>–</>
  const steps = rank_before - rank
  const word = steps > 0 ? `up ${formatCount(steps)}` : `down ${formatCount(-steps)}`
  return (
    <>
      {formatCount(rank_before)}
      {steps !== 0 && <span class="muted small"> ({word})</span>}
    </>
  )
}

/** Iteration of the best; a late improvement alone does not predict further ones. */
function lastGain({ best_so_far }: Ranking): string {
  const bestIndex = best_so_far.findIndex(({ fitness }) => fitness === best_so_far.at(-1)?.fitness)
  if (bestIndex < 0 || best_so_far.at(-1)?.fitness === null)
    return 'No design succeeds in every scenario.'
  const since = best_so_far.length - 1 - bestIndex
  return `The best is from iteration ${best_so_far[bestIndex].index}; ${since === 0 ? 'the last one' : `no improvement in the ${since} iterations after it`}.`
}

function BestSoFar({ ranking }: { ranking: Ranking }) {
  const drawn = useMemo(
    () => ({
      x: ranking.best_so_far.map((point) => point.index),
      series: [
        {
          label: 'best so far',
          values: ranking.best_so_far.map((point) => point.fitness),
          colour: '--series-1' as const,
          width: 2,
        },
      ],
    }),
    [ranking],
  )
  return (
    <LineCard
      title="Best so far under this preference"
      note={lastGain(ranking)}
      caption="Best so far by iteration"
      label="Best fitness so far under this preference by iteration"
      x={drawn.x}
      xLabel="iteration"
      counted
      yLabel="fitness"
      series={drawn.series}
      logarithmic
      height={220}
    />
  )
}
