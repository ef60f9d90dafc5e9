/** What the designs of a job trade: its Pareto front, and the preference that would choose a design. */

import { useRef } from 'preact/hooks'
import { get, getBytes } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Front, Job } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { formatCount } from '../../format/number'
import { type Place, placeOf, placeWord } from '../../format/place'
import { setQuery, usePlace } from '../../router/navigation'
import { decodeParticles, type Particles } from '../designs/particles'
import { HypervolumeCard } from './hypervolume-card'
import { PreferenceCard } from './preference-card'
import { ScatterCard } from './scatter-card'
import { WinnersCard } from './winners-card'

/** How often a running job's front is asked for again [ms]. */
const RENEW_MS = 8000
/** Designs that are drawn behind the front; of more, some. */
const MOST_DRAWN = 5000

export function TradeOffsPanel({ job }: { job: Job }) {
  if (job.best_fitness === null) {
    return (
      <section class="card">
        <Empty title="No front yet">
          <p>It appears here as soon as a design has walked in every scenario.</p>
        </Empty>
      </section>
    )
  }
  return <TradeOffs job={job} />
}

function TradeOffs({ job }: { job: Job }) {
  const { query } = usePlace()
  const wanted = useSlowly(job.iterations, RENEW_MS)
  const found = useResource(`${job.id} ${wanted}`, (signal) =>
    get('/v1/jobs/{job_id}/front', { path: { job_id: job.id }, signal }),
  )
  // While a newer one is on its way, the one before stays to be looked at.
  const shown = useRef<Front | null>(null)
  if (found.data) shown.current = found.data
  const front = shown.current
  const particles = useResource(`${job.id} ${wanted} all`, (signal) =>
    getBytes('/v1/jobs/{job_id}/particles', {
      path: { job_id: job.id },
      query: { objectives: true, max_points: MOST_DRAWN },
      signal,
    }).then(decodeParticles),
  )
  const all = useRef<Particles | null>(null)
  if (particles.data) all.current = particles.data
  const chosen = placeOf(query.get('design'))
  const choose = (place: Place) => setQuery({ design: placeWord(place) })
  return (
    <div class="stack">
      {found.error && (
        <ErrorNotice what="The front cannot be shown." error={found.error} retry={found.reload} />
      )}
      {!front && found.loading && <Loading what="the front" />}
      {front && (
        <>
          <p data-front={front.size} data-knees={front.knees.length}>
            <strong>{formatCount(front.size)}</strong> of {formatCount(front.designs_judged)}{' '}
            designs that walk in every scenario are on the Pareto front: no other is as good in
            every objective and better in one.
          </p>
          <ScatterCard
            job={job}
            front={front}
            all={all.current}
            chosen={chosen}
            onChoose={choose}
          />
          <PreferenceCard job={job} chosen={chosen} />
          <WinnersCard job={job} front={front} onChoose={choose} />
          <HypervolumeCard front={front} />
        </>
      )}
    </div>
  )
}
