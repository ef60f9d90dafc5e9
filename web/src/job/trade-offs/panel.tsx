/** Pareto front of a job, and the preferences that select its designs. */

import { get, getBytes, post } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Front, FrontWinner, Job, PreferenceFit, PreferenceFor } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber, NONE, percent } from '../../format/number'
import { type Place, placeOf, placeWord } from '../../format/place'
import { capitalized, inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { jobPath, withQuery } from '../../router/routes'
import { IterationChart } from '../by-iteration'
import { DesignLink, designColumn, objectiveColumns } from '../columns'
import { decodeParticles } from '../designs/particles'
import { preferenceQuery, weighed } from '../preference'
import { ownerWords } from './designs'
import { fitColumn, ScatterCard } from './scatter-card'

const RENEW_MS = 8000
const MOST_DRAWN = 5000
const MOST_LISTED = 1000

export default function TradeOffsPanel({ job }: { job: Job }) {
  const selected = placeOf(usePlace().query.get('design'))
  const iterations = useSlowly(job.iterations, RENEW_MS)
  const exists = job.best_fitness !== null
  const path = { job_id: job.id }
  const front = useResource(
    exists ? `${job.id} ${iterations}` : null,
    (signal) => post('/v1/jobs/{job_id}/front', { path, body: { most: MOST_LISTED }, signal }),
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

function PreferenceCard({ job, selected }: { job: Job; selected: Place | null }) {
  const key = selected && `${job.id} ${job.iterations} ${placeWord(selected)}`
  const preferenceFor = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/preference-for', { path: { job_id: job.id }, query: selected!, signal }),
  )
  return (
    <Card
      title="Preference for a design"
      data={{ 'data-selected-design': selected ? placeWord(selected) : '' }}
    >
      <div aria-live="polite">
        {selected ? (
          <Loaded
            resource={preferenceFor}
            what="the preference"
            failed="Could not find a preference."
          >
            {(data) => <Fits job={job} preferenceFor={data} />}
          </Loaded>
        ) : (
          <Empty title="No design selected">
            <p>Click a design in the chart, or select one in a table.</p>
          </Empty>
        )}
      </div>
    </Card>
  )
}

function Fits({ job, preferenceFor }: { job: Job; preferenceFor: PreferenceFor }) {
  const { chosen: design, fits, wins } = preferenceFor
  const { iteration, particle } = design
  const [best] = fits
  const query = { preference: preferenceQuery(best.preference) }
  return (
    <div class="stack" data-wins={wins}>
      <p>
        <DesignLink job={job} iteration={iteration} particle={particle} /> {verdict(preferenceFor)}
      </p>
      <p class="row">
        <a class="button compact" href={withQuery(jobPath(job.id, 'preferences'), query)}>
          Rank the history with it
        </a>
        <a
          class="button primary compact"
          href={withQuery('/jobs/new', { clone: job.id, ...query, iteration, particle })}
        >
          Start a job with it
        </a>
      </p>
      <Table
        caption="Preferences for the design, by biases"
        rows={fits}
        columns={fitColumns(job, best)}
      />
      <p class="muted small table-note">
        For each set of biases: the exponents with the largest lead of the design, or, if it cannot
        win, with its best rank found. Exponents sum to 1.
      </p>
    </div>
  )
}

function verdict({ wins, certain, on_front, fits: [best] }: PreferenceFor): string {
  const owners = best.biases_of.map(ownerWords).join(', ')
  if (wins) {
    const lead =
      best.margin === null ? '' : `; under it, the next design is ${percent(best.margin, 2)} worse`
    return `is the best design of the job with the biases of ${owners} and the exponents below${lead}.`
  }
  const front = on_front ? '' : ' Other designs dominate it.'
  const proof = certain
    ? 'With these biases, there is no preference under which it is the best.'
    : 'No preference was found under which it is the best.'
  return `has rank ${formatCount(best.rank)} at best, with the biases of ${owners}.${front} ${proof}`
}

function fitColumns(job: Job, best: PreferenceFit): readonly Column<PreferenceFit>[] {
  return [
    {
      key: 'biases of',
      header: true,
      value: ({ biases_of }) => biases_of.map(ownerWords).join(', '),
    },
    ...weighed(best.preference).map(
      (objective, index): Column<PreferenceFit> => ({
        key: objective,
        label: inWords(objective),
        numeric: true,
        cell: ({ preference: { bias, exponent } }) => (
          <span class="weights-cell">
            <span>e {formatExact(exponent[index], 4)}</span>
            <span class="muted small">b {formatExact(bias[index], 4)}</span>
          </span>
        ),
      }),
    ),
    { key: 'rank', numeric: true, value: ({ rank }) => rank },
    {
      key: 'lead',
      unit: '%',
      numeric: true,
      value: ({ margin }) => margin,
      cell: ({ margin }) => (margin === null ? NONE : formatNumber(margin * 100, 3)),
    },
    {
      key: 'closest rival',
      cell: ({ rival }) => (rival ? <DesignLink job={job} {...rival} /> : NONE),
    },
  ]
}
