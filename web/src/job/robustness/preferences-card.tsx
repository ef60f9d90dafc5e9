/** Comparison of preferences by the robustness of their winners: A, B, C and random ones. */

import { useState } from 'preact/hooks'
import { post } from '../../api/client'
import { useResource } from '../../api/resource'
import type { Job, PreferenceWinner, RobustPreferences } from '../../api/types'
import { ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { formatCount, formatExact, formatNumber, NONE, percent } from '../../format/number'
import { placeWord } from '../../format/place'
import { jobPath, withQuery } from '../../router/routes'
import { Where } from '../designs/selected-designs'
import { searchedVariables } from '../designs/variables'
import { preferenceQuery } from '../preference'

/** Fewest designs simulated around each winner. */
const LEAST_SAMPLES = 48

/** Number of winners compared; servers limit the length of simulations. */
const CANDIDATES = 5

/** Responses since the page was loaded; computing one requires simulations. */
const cache = new Map<string, Promise<RobustPreferences>>()

export function RobustPreferencesCard({ job }: { job: Job }) {
  const [walked, setWalked] = useState(false)
  const key = `${job.id} ${job.evaluations} ${walked}`
  const samples = Math.max(LEAST_SAMPLES, 4 * (searchedVariables(job.spec).length + 1))
  const preferences = useResource(key, () => request(job.id, key, walked ? samples : 0))
  // Keep the winners visible while their robustness is computed.
  const [previous, setPrevious] = useState<RobustPreferences | null>(null)
  if (preferences.data && preferences.data !== previous) setPrevious(preferences.data)
  const shown = preferences.data ?? previous
  return (
    <section
      class="card"
      aria-labelledby="robust-preferences"
      data-most-robust={shown && shown.samples > 0 ? mostRobust(shown) : ''}
    >
      <header class="row spread">
        <h2 id="robust-preferences">Robustness by preference</h2>
        {!walked && (
          <button type="button" class="compact" onClick={() => setWalked(true)}>
            Simulate designs around the winners
          </button>
        )}
      </header>
      <div class="stack">
        {preferences.error && (
          <ErrorNotice
            what="Could not compare the preferences."
            error={preferences.error}
            retry={preferences.reload}
          />
        )}
        {preferences.loading && (
          <Loading what={walked ? 'simulations around the winners' : 'the winners'} />
        )}
        {shown && <Winners job={job} preferences={shown} />}
      </div>
    </section>
  )
}

function request(id: string, key: string, samples: number): Promise<RobustPreferences> {
  const cached = cache.get(key)
  if (cached) return cached
  const answer = post('/v1/jobs/{job_id}/preferences', {
    path: { job_id: id },
    body: {
      drawn: 512,
      candidates: CANDIDATES,
      samples,
      radius: 0.02,
      seed: 1,
      precision: 'single',
    },
  })
  cache.set(key, answer)
  answer.catch(() => cache.delete(key))
  return answer
}

function mostRobust({ candidates: [first] }: RobustPreferences): string {
  return first ? placeWord(first) : ''
}

function Winners({ job, preferences }: { job: Job; preferences: RobustPreferences }) {
  const [first] = preferences.candidates
  return (
    <>
      {first?.index && (
        <p>
          The most robust winner is <Where job={job} {...first} />, best under {winsUnder(first)}.
          Its robustness index is {formatNumber(first.index.value, 3)}; lower is more robust.
        </p>
      )}
      <Table
        caption="Winners under A, B, C and random preferences"
        rows={preferences.candidates}
        rowKey={({ iteration, particle }) => `${iteration} ${particle}`}
        rowData={({ named }) => ({ 'data-wins-under': named.join(' ') })}
        columns={winnerColumns(job, preferences)}
      />
      <p class="muted small">
        All designs ranked under A, B, C and {formatCount(preferences.drawn)} random preferences:{' '}
        {formatCount(preferences.winners)} of them win under at least one.{' '}
        {preferences.samples > 0
          ? `The index is estimated from ${formatCount(preferences.samples)} designs around each, with a 95 % interval. `
          : ''}
        Only evaluated designs can win; to search under a preference, run another job.
      </p>
    </>
  )
}

function winsUnder({ named, share }: PreferenceWinner): string {
  const drawn = `${percent(share, 2)} of the random preferences`
  return named.length > 0 ? `${named.join(', ')} and ${drawn}` : drawn
}

function winnerColumns(
  job: Job,
  preferences: RobustPreferences,
): readonly Column<PreferenceWinner>[] {
  const index: Column<PreferenceWinner> = {
    key: 'index',
    label: 'Robustness index',
    numeric: true,
    value: (winner) => winner.index?.value ?? null,
    cell: (winner) => <Index winner={winner} />,
  }
  return [
    {
      key: 'named',
      label: 'Best under',
      header: true,
      value: ({ named }) => named.join(', ') || null,
      cell: ({ named }) => named.join(', ') || 'random ones only',
    },
    {
      key: 'share',
      label: 'Share of random',
      numeric: true,
      minor: true,
      value: ({ share }) => share,
      cell: ({ share }) => percent(share, 2),
    },
    { key: 'design', label: 'Design', cell: (winner) => <Where job={job} {...winner} /> },
    ...(preferences.samples > 0 ? [index] : []),
    {
      key: 'fitness',
      label: 'Fitness (job’s preference)',
      numeric: true,
      value: ({ fitness }) => fitness,
      cell: ({ fitness }) => formatNumber(fitness),
    },
    {
      key: 'loss',
      label: 'Loss',
      unit: '%',
      numeric: true,
      value: ({ loss }) => loss,
      cell: ({ loss }) => formatExact(loss === null ? null : loss * 100, 2),
    },
    {
      key: 'rank',
      label: 'Preference',
      cell: ({ preference }) => (
        <a
          class="nowrap"
          href={withQuery(jobPath(job.id, 'preferences'), {
            preference: preferenceQuery(preference),
          })}
        >
          rank by it
        </a>
      ),
    },
  ]
}

function Index({ winner: { index } }: { winner: PreferenceWinner }) {
  if (!index) return <>{NONE}</>
  return (
    <>
      {formatNumber(index.value, 3)}{' '}
      <span class="muted small">
        ({formatNumber(index.low, 3)}–{formatNumber(index.high, 3)})
      </span>
    </>
  )
}
