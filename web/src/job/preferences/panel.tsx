/** What-if analysis: ranking of a job's history under another preference, without simulation. */

import { useEffect, useState } from 'preact/hooks'
import { get, post } from '../../api/client'
import { LatestAnswer } from '../../api/latest-answer'
import { useResource } from '../../api/resource'
import type { Job, JobSpec, Preference, Ranking } from '../../api/types'
import { ErrorNotice, Loading } from '../../components/feedback'
import { useQueryValue } from '../../router/query-value'
import { preferenceOf, preferenceQuery } from '../preference'
import { RankingResult } from './ranking-result'
import { PreferenceSliders, same } from './sliders'
import './what-if.css'

export function PreferencesPanel({ job }: { job: Job }) {
  const jobPreference = (job.spec as JobSpec).preference as Preference
  const codec = {
    read: preferenceOf,
    write: (preference: Preference) =>
      same(preference, jobPreference) ? null : preferenceQuery(preference),
  }
  const [preference, setPreference] = useQueryValue('preference', codec, jobPreference)
  const { ranking, error } = useRanking(job, preference)
  const presets = useResource('preferences', (signal) =>
    get('/v1/preferences', { signal }).then((answer) => answer.items),
  )
  const units = new Map(job.objectives.map((o) => [o.name, o.unit]))
  return (
    <div class="what-if">
      <PreferenceSliders
        preference={preference}
        jobPreference={jobPreference}
        presets={presets.data ?? []}
        units={units}
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

/** Ranking, updated when the preference changes or the job commits. */
function useRanking(job: Job, preference: Preference) {
  const [ranking, setRanking] = useState<Ranking | null>(null)
  const [error, setError] = useState<unknown>(null)
  const [latest] = useState(
    () =>
      new LatestAnswer(
        (body: { preference: Preference; top: number }, signal) =>
          post('/v1/jobs/{job_id}/ranking', { path: { job_id: job.id }, body, signal }),
        (answer) => {
          setRanking(answer)
          setError(null)
        },
        setError,
      ),
  )
  useEffect(() => latest.ask({ preference, top: 20 }), [preference, job.iterations])
  useEffect(() => () => latest.stop(), [])
  return { ranking, error }
}
