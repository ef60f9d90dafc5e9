/** Which preference's winner is the most robust: A, B and C compared, and preferences that are drawn. */

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

/** Designs that walk around each winner, at least. */
const LEAST_SAMPLES = 48

/** Winners that are compared; a server allows walks of some length only. */
const CANDIDATES = 5

/** What was asked since the page was loaded; it takes walks. */
const asked = new Map<string, Promise<RobustPreferences>>()

export function RobustPreferencesCard({ job }: { job: Job }) {
  const [walked, setWalked] = useState(false)
  const key = `${job.id} ${job.evaluations} ${walked}`
  const samples = Math.max(LEAST_SAMPLES, 4 * (searchedVariables(job.spec).length + 1))
  const found = useResource(key, () => ask(job.id, key, walked ? samples : 0))
  // Without walks the same winners are known, but not how robust they are.
  const [before, setBefore] = useState<RobustPreferences | null>(null)
  if (found.data && found.data !== before) setBefore(found.data)
  const shown = found.data ?? before
  return (
    <section
      class="card"
      aria-labelledby="robust-preferences"
      data-most-robust={shown && shown.samples > 0 ? mostRobust(shown) : ''}
    >
      <header class="row spread">
        <h2 id="robust-preferences">Which preference wins robustly</h2>
        {!walked && (
          <button type="button" class="compact" onClick={() => setWalked(true)}>
            Let designs walk around the winners
          </button>
        )}
      </header>
      <div class="stack">
        {found.error && (
          <ErrorNotice
            what="Preferences cannot be compared."
            error={found.error}
            retry={found.reload}
          />
        )}
        {found.loading && <Loading what={walked ? 'walks around the winners' : 'the winners'} />}
        {shown && <Winners job={job} found={shown} />}
      </div>
    </section>
  )
}

function ask(id: string, key: string, samples: number): Promise<RobustPreferences> {
  const known = asked.get(key)
  if (known) return known
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
  asked.set(key, answer)
  answer.catch(() => asked.delete(key))
  return answer
}

function mostRobust({ candidates: [first] }: RobustPreferences): string {
  return first ? placeWord(first) : ''
}

function Winners({ job, found }: { job: Job; found: RobustPreferences }) {
  const [first] = found.candidates
  return (
    <>
      {first?.index && (
        <p>
          The most robust is <Where job={job} {...first} />, best under {winsUnder(first)}: its
          robustness index is {formatNumber(first.index.value, 3)}; less is more robust.
        </p>
      )}
      <Table
        caption="Winners under A, B, C and drawn preferences"
        rows={found.candidates}
        rowKey={({ iteration, particle }) => `${iteration} ${particle}`}
        rowData={({ named }) => ({ 'data-wins-under': named.join(' ') })}
        columns={winnerColumns(job, found)}
      />
      <p class="muted small">
        All designs ranked anew under A, B, C and {formatCount(found.drawn)} drawn preferences:{' '}
        {formatCount(found.winners)} of them win under any.{' '}
        {found.samples > 0
          ? `The index is from ${formatCount(found.samples)} designs around each, with its interval of 95 %. `
          : ''}
        Only designs that the job has tried can win: a job of its own says what a preference finds.
      </p>
    </>
  )
}

function winsUnder({ named, share }: PreferenceWinner): string {
  const drawn = `${percent(share, 2)} of the drawn preferences`
  return named.length > 0 ? `${named.join(', ')} and ${drawn}` : drawn
}

function winnerColumns(job: Job, found: RobustPreferences): readonly Column<PreferenceWinner>[] {
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
      cell: ({ named }) => named.join(', ') || 'drawn ones only',
    },
    {
      key: 'share',
      label: 'Of the drawn',
      numeric: true,
      minor: true,
      value: ({ share }) => share,
      cell: ({ share }) => percent(share, 2),
    },
    { key: 'design', label: 'Design', cell: (winner) => <Where job={job} {...winner} /> },
    ...(found.samples > 0 ? [index] : []),
    {
      key: 'fitness',
      label: 'Fitness by the job’s own',
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
