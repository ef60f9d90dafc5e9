/** Preferences under which a selected design wins. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, PreferenceFit, PreferenceFor } from '../../api/types'
import { Card, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber, NONE, percent } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { jobPath, withQuery } from '../../router/routes'
import { DesignLink } from '../columns'
import { preferenceQuery, weighed } from '../preference'
import { ownerWords } from './designs'

export function PreferenceCard({ job, selected }: { job: Job; selected: Place | null }) {
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
