/** The preference that would have chosen a design: the usual question the other way round. */

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
  const found = useResource(key, (signal) =>
    get('/v1/jobs/{job_id}/preference-for', { path: { job_id: job.id }, query: chosen!, signal }),
  )
  return (
    <section
      class="card"
      aria-labelledby="preference-for"
      aria-live="polite"
      data-chosen={chosen ? placeWord(chosen) : ''}
    >
      <h2 id="preference-for">Which preference would have chosen a design</h2>
      {!chosen && (
        <Empty title="No design chosen">
          <p>Click one in the chart, or choose one in a table.</p>
        </Empty>
      )}
      {found.error && (
        <ErrorNotice
          what="Its preference cannot be told."
          error={found.error}
          retry={found.reload}
        />
      )}
      {chosen && found.loading && !found.data && <Loading what="its preference" />}
      {chosen && found.data && <Fits job={job} found={found.data} />}
    </section>
  )
}

function Fits({ job, found }: { job: Job; found: PreferenceFor }) {
  const { chosen, fits, wins } = found
  const [best] = fits
  const asked = { preference: preferenceQuery(best.preference) }
  const start = withQuery('/jobs/new', {
    clone: job.id,
    ...asked,
    iteration: chosen.iteration,
    particle: chosen.particle,
  })
  return (
    <div class="stack" data-wins={wins}>
      <p>
        <Where job={job} iteration={chosen.iteration} particle={chosen.particle} /> {verdict(found)}
      </p>
      <p class="row">
        <a class="button compact" href={withQuery(jobPath(job.id, 'preferences'), asked)}>
          Rank the history under it
        </a>
        <a class="button primary compact" href={start}>
          Start a job with it
        </a>
      </p>
      <Table
        caption="Preferences that suit the design, by their biases"
        rows={fits}
        rowKey={({ biases_of }) => biases_of.join()}
        columns={fitColumns(job, best)}
      />
      <p class="muted small table-note">
        For each set of biases the exponents under which the design leads by the most; where it
        cannot win, those of its best rank that was found. Exponents sum to 1.
      </p>
    </div>
  )
}

function verdict({ wins, certain, on_front, fits: [best] }: PreferenceFor): string {
  const whose = best.biases_of.map(ownerWords).join(', ')
  if (wins) {
    const lead =
      best.margin === null ? '' : `; the next one is ${percent(best.margin, 2)} worse under it`
    return `is the best of the job with the biases of ${whose} and the exponents below${lead}.`
  }
  const front = on_front ? '' : ' Others dominate it.'
  const proof = certain
    ? 'With these biases there is no preference under which it is the best.'
    : 'No preference was found under which it is the best.'
  return `is number ${formatCount(best.rank)} at best, with the biases of ${whose}.${front} ${proof}`
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
      label: 'Before the best of the others',
      cell: ({ rival }) => (rival ? <Where job={job} {...rival} /> : NONE),
    },
  ]
}
