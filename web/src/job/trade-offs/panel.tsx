/** Pareto front of a job, and the preferences that select its designs. */

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

/** Polling interval while the job runs [ms]. */
const RENEW_MS = 8000
/** Most designs drawn behind the front. */
const MOST_DRAWN = 5000

export function TradeOffsPanel({ job }: { job: Job }) {
  if (job.best_fitness === null) {
    return (
      <section class="card">
        <Empty title="No front yet">
          <p>The front appears here once a design has succeeded in every scenario.</p>
        </Empty>
      </section>
    )
  }
  return <TradeOffs job={job} />
}

function TradeOffs({ job }: { job: Job }) {
  const { query } = usePlace()
  const iterations = useSlowly(job.iterations, RENEW_MS)
  const loadedFront = useResource(`${job.id} ${iterations}`, (signal) =>
    get('/v1/jobs/{job_id}/front', { path: { job_id: job.id }, signal }),
  )
  // Keep the previous result while the next one loads.
  const shown = useRef<Front | null>(null)
  if (loadedFront.data) shown.current = loadedFront.data
  const front = shown.current
  const particles = useResource(`${job.id} ${iterations} all`, (signal) =>
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
      {loadedFront.error && (
        <ErrorNotice
          what="Could not load the front."
          error={loadedFront.error}
          retry={loadedFront.reload}
        />
      )}
      {!front && loadedFront.loading && <Loading what="the front" />}
      {front && (
        <>
          <p data-front={front.size} data-knees={front.knees.length}>
            <strong>{formatCount(front.size)}</strong> of {formatCount(front.designs_judged)}{' '}
            successful designs are on the Pareto front: no other design is at least as good in every
            objective and better in one.
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
