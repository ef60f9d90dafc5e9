/** Preferences under which a chosen design wins. */

import { get } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, PreferenceFit, PreferenceFor } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber, NONE, percent } from '../../format/number'
import { type Place, placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { jobPath, withQuery } from '../../router/routes'
import { Where } from '../designs/selected-designs'
import { preferenceQuery, weighed } from '../preference'
import { ownerWords } from './designs'

export function PreferenceCard({ job, chosen }: { job: Job; chosen: Place | null }) {
  const key = chosen && `${job.id} ${job.iterations} ${placeWord(chosen)}`
  const preferenceFor = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/preference-for', { path: { job_id: job.id }, query: chosen!, signal }),
  )
  return (
    <section
      class="card"
      aria-labelledby="preference-for"
      aria-live="polite"
      data-chosen={chosen ? placeWord(chosen) : ''}
    >
      <h2 id="preference-for">Preference for a design</h2>
      {!chosen && (
        <Empty title="No design chosen">
          <p>Click a design in the chart, or choose one in a table.</p>
        </Empty>
      )}
      {preferenceFor.error && (
        <ErrorNotice
          what="Could not find a preference."
          error={preferenceFor.error}
          retry={preferenceFor.reload}
        />
      )}
      {chosen && preferenceFor.loading && !preferenceFor.data && <Loading what="the preference" />}
      {chosen && preferenceFor.data && <Fits job={job} preferenceFor={preferenceFor.data} />}
    </section>
  )
}

function Fits({ job, preferenceFor }: { job: Job; preferenceFor: PreferenceFor }) {
  const { chosen, fits, wins } = preferenceFor
  const [best] = fits
  const query = { preference: preferenceQuery(best.preference) }
  const start = withQuery('/jobs/new', {
    clone: job.id,
    ...query,
    iteration: chosen.iteration,
    particle: chosen.particle,
  })
  return (
    <div class="stack" data-wins={wins}>
      <p>
        <Where job={job} iteration={chosen.iteration} particle={chosen.particle} />{' '}
        {verdict(preferenceFor)}
      </p>
      <p class="row">
        <a class="button compact" href={withQuery(jobPath(job.id, 'preferences'), query)}>
          Rank the history with it
        </a>
        <a class="button primary compact" href={start}>
          Start a job with it
        </a>
      </p>
      <Table
        caption="Preferences for the design, by biases"
        rows={fits}
        rowKey={({ biases_of }) => biases_of.join()}
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
  const whose = best.biases_of.map(ownerWords).join(', ')
  if (wins) {
    const lead =
      best.margin === null ? '' : `; under it, the next design is ${percent(best.margin, 2)} worse`
    return `is the best design of the job with the biases of ${whose} and the exponents below${lead}.`
  }
  const front = on_front ? '' : ' Other designs dominate it.'
  const proof = certain
    ? 'With these biases, there is no preference under which it is the best.'
    : 'No preference was found under which it is the best.'
  return `has rank ${formatCount(best.rank)} at best, with the biases of ${whose}.${front} ${proof}`
}

function fitColumns(job: Job, best: PreferenceFit): readonly Column<PreferenceFit>[] {
  return [
    {
      key: 'biases',
      label: 'Biases of',
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
    { key: 'rank', label: 'Rank', numeric: true, value: ({ rank }) => rank },
    {
      key: 'margin',
      label: 'Lead',
      unit: '%',
      numeric: true,
      value: ({ margin }) => margin,
      cell: ({ margin }) => (margin === null ? NONE : formatNumber(margin * 100, 3)),
    },
    {
      key: 'rival',
      label: 'Closest rival',
      cell: ({ rival }) => (rival ? <Where job={job} {...rival} /> : NONE),
    },
  ]
}
