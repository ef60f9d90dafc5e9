/** Pareto front of a job, and the preferences that select its designs. */

import { get, getBytes } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Front, FrontWinner, Job } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Table } from '../../components/table/table'
import { formatCount, formatNumber, percent } from '../../format/number'
import { type Place, placeOf, placeWord } from '../../format/place'
import { capitalized } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { IterationChart } from '../by-iteration'
import { designColumn, objectiveColumns } from '../columns'
import { decodeParticles } from '../designs/particles'
import { ownerWords } from './designs'
import { PreferenceCard } from './preference-card'
import { fitColumn, ScatterCard } from './scatter-card'

const RENEW_MS = 8000
const MOST_DRAWN = 5000

export default function TradeOffsPanel({ job }: { job: Job }) {
  const selected = placeOf(usePlace().query.get('design'))
  const iterations = useSlowly(job.iterations, RENEW_MS)
  const exists = job.best_fitness !== null
  const path = { job_id: job.id }
  const front = useResource(
    exists ? `${job.id} ${iterations}` : null,
    (signal) => get('/v1/jobs/{job_id}/front', { path, signal }),
    { keep: true },
  )
  const all = useResource(
    exists ? `${job.id} ${iterations} all` : null,
    (signal) => {
      const query = { objectives: true, max_points: MOST_DRAWN }
      return getBytes('/v1/jobs/{job_id}/particles', { path, query, signal }).then(decodeParticles)
    },
    { keep: true },
  )
  if (!exists) {
    return (
      <EmptyCard title="No front yet">
        The front appears here once a design has succeeded in every scenario.
      </EmptyCard>
    )
  }
  const select = (place: Place) => setQuery({ design: placeWord(place) })
  return (
    <div class="stack">
      <Loaded resource={front} what="the front">
        {(data) => (
          <>
            <p data-front={data.size} data-knees={data.knees.length}>
              <strong>{formatCount(data.size)}</strong> of {formatCount(data.designs_judged)}{' '}
              successful designs are on the Pareto front: no other design is at least as good in
              every objective and better in one.
            </p>
            <ScatterCard
              job={job}
              front={data}
              all={all.data}
              selected={selected}
              onSelect={select}
            />
            <PreferenceCard job={job} selected={selected} />
            <WinnersCard job={job} front={data} onSelect={select} />
            <HypervolumeCard front={data} />
          </>
        )}
      </Loaded>
    </div>
  )
}

interface WinnersCardProps {
  job: Job
  front: Front
  onSelect: (place: Place) => void
}

/** Best designs under A, B, C and the job's preference, and their positions relative to the front. */
function WinnersCard({ job, front, onSelect }: WinnersCardProps) {
  return (
    <Card title="Winners by preference">
      <Table<FrontWinner>
        caption="Best designs by preference"
        rows={front.winners}
        rowData={(winner) => ({
          'data-preference': winner.preference,
          'data-place': placeWord(winner),
        })}
        columns={[
          {
            key: 'best under',
            header: true,
            value: ({ preference }) => capitalized(ownerWords(preference)),
          },
          designColumn(job),
          {
            key: 'on the front',
            value: ({ dominated_by }) => dominated_by,
            cell: ({ on_front, dominated_by, behind }) =>
              on_front
                ? 'yes'
                : `no: dominated by ${formatCount(dominated_by)}, one of them ${percent(behind, 2)} better in every objective`,
          },
          ...objectiveColumns(front.objectives),
          fitColumn(null, onSelect),
        ]}
      />
      <p class="muted small table-note">
        Biases apply in each scenario separately, so a design that is dominated over all scenarios
        can still win.
      </p>
    </Card>
  )
}

function HypervolumeCard({ front }: { front: Front }) {
  const { iterations, hypervolume, hypervolume_error: error } = front
  const now = formatNumber(hypervolume, 4) + (error > 0 ? ` ± ${formatNumber(error, 1)}` : '')
  return (
    <IterationChart
      title="Hypervolume"
      note={`Share of the box between ideal and reference point that the front dominates, on logarithmic axes. It never decreases. Current value: ${now}.`}
      label={`Hypervolume over ${iterations.length} iterations, now ${now}`}
      rows={iterations}
      name="hypervolume"
      value={(row) => row.hypervolume}
      format={(value) => formatNumber(value, 4)}
      fromZero
      height={220}
    />
  )
}
