/** What one tournament has come to: ranks, data profiles, and its runs problem by problem. */

import { get } from '../api/client'
import { usePolling, useResource } from '../api/resource'
import type { Tournament, TournamentStandings } from '../api/types'
import { Empty, ErrorNotice, Loading } from '../components/feedback'
import { Combobox } from '../components/fields/combobox'
import { formatCount, formatNumber } from '../format/number'
import { ALL_JOBS, Breadcrumbs } from '../router/breadcrumbs'
import { setQuery, usePlace } from '../router/navigation'
import { isUnderWay, rankedMethods, runCount } from './methods'
import { problemsInWords } from './page'
import { ProblemPanel } from './problem-panel'
import { ProfilesCard } from './profiles-card'
import { RanksCard } from './ranks-card'

/** How often a tournament whose runs are under way is asked for again [ms]. */
const RENEW_MS = 15_000

export function StandingsPage({ id }: { id: string }) {
  const { query } = usePlace()
  const other = query.get('compare')
  const listed = useResource('tournaments', (signal) => get('/v1/tournaments', { signal }))
  const found = useResource(`${id} ${other}`, (signal) =>
    get('/v1/tournaments/{job_id}', {
      path: { job_id: id },
      query: { compare_with: other },
      signal,
    }),
  )
  const listing = listed.data?.items.find(({ entrants }) => entrants.some(({ job }) => job === id))
  const tournament = found.data?.tournament ?? listing
  const renew = () => {
    found.reload()
    listed.reload()
  }
  usePolling(renew, RENEW_MS, tournament !== undefined && isUnderWay(tournament))
  const hasRuns = tournament === undefined || runCount(tournament).ended > 0
  const name = `Tournament${tournament ? ` on ${problemsInWords(tournament.problems)}` : ''}`
  return (
    <>
      <Breadcrumbs
        crumbs={[ALL_JOBS, ['All tournaments', '/tournaments']]}
        here={name}
        title={tournament ? [name, runsInWords(tournament)] : [name]}
      />
      <header class="page-header">
        <h1>{name}</h1>
      </header>
      <div class="stack">
        {tournament && <Size tournament={tournament} />}
        {!hasRuns && <NoRuns />}
        {hasRuns && found.error && (
          <ErrorNotice
            what="The tournament cannot be shown."
            error={found.error}
            retry={found.reload}
          />
        )}
        {hasRuns && found.loading && !found.data && <Loading what="all runs" />}
        {found.data && (
          <Standings
            found={found.data}
            id={id}
            others={(listed.data?.items ?? []).filter((t) => t.id !== found.data?.tournament.id)}
          />
        )}
      </div>
    </>
  )
}

function runsInWords(tournament: Tournament): string {
  const { ended, planned } = runCount(tournament)
  return ended === planned ? `${planned} runs` : `running ${ended}/${planned}`
}

function Size({ tournament }: { tournament: Tournament }) {
  const { ended, planned } = runCount(tournament)
  return (
    <dl class="figures card">
      <div>
        <dt>methods</dt>
        <dd>{formatCount(tournament.entrants.length)}</dd>
      </div>
      <div>
        <dt>problems</dt>
        <dd>{formatCount(tournament.problems.length)}</dd>
      </div>
      <div>
        <dt>evaluations of a run</dt>
        <dd>{formatCount(tournament.evaluations)}</dd>
      </div>
      <div data-runs={ended}>
        <dt>runs on every problem</dt>
        <dd>
          {formatCount(ended)} of {formatCount(planned)}
        </dd>
      </div>
    </dl>
  )
}

function NoRuns() {
  return (
    <section class="card">
      <Empty title="No run has ended yet">
        <p>Ranks and clouds appear here with the first run of a method on all problems.</p>
      </Empty>
    </section>
  )
}

function Standings({
  found,
  id,
  others,
}: {
  found: TournamentStandings
  id: string
  /** Other tournaments, whose ranks may be compared. */
  others: readonly Tournament[]
}) {
  const { query } = usePlace()
  const methods = rankedMethods(found, query)
  return (
    <>
      <RanksCard found={found} methods={methods} />
      {others.length > 0 && (
        <Comparison found={found} others={others} chosen={query.get('compare')} />
      )}
      <ProfilesCard profiles={found.profiles} methods={methods} />
      <ProblemPanel found={found} id={id} methods={methods} asked={query.get('problem')} />
    </>
  )
}

function nameOf(tournament: Tournament | undefined, id: string): string {
  return tournament ? `${problemsInWords(tournament.problems)} (${id})` : id
}

function Comparison({
  found,
  others,
  chosen,
}: {
  found: TournamentStandings
  others: readonly Tournament[]
  chosen: string | null
}) {
  const correlation = found.rank_correlation
  return (
    <section class="card" aria-labelledby="comparison">
      <header class="row spread">
        <h2 id="comparison">Ranks on other problems</h2>
        <Combobox
          label="Compare with the tournament"
          shown={
            chosen === null
              ? 'none'
              : nameOf(
                  others.find(({ id }) => id === chosen),
                  chosen,
                )
          }
          groups={[
            {
              label: '',
              choices: [
                { value: '', label: 'none' },
                ...others.map((other) => ({ value: other.id, label: nameOf(other, other.id) })),
              ],
            },
          ]}
          onChoose={(value) => setQuery({ compare: value || null })}
        />
      </header>
      {correlation === null ? (
        <p class="muted">
          How far two tournaments rank the methods alike, by Spearman’s correlation of mean ranks.
        </p>
      ) : correlation.value === null ? (
        <p>
          Both have {formatCount(correlation.methods.length)} methods in common; a correlation needs
          three that are not all equal.
        </p>
      ) : (
        <p>
          Spearman’s correlation of mean ranks over {formatCount(correlation.methods.length)}{' '}
          methods in both is <strong>{formatNumber(correlation.value, 2)}</strong>, from{' '}
          {formatNumber(correlation.low, 2)} to {formatNumber(correlation.high, 2)}. The interval
          says how sure the ranks are, not what other methods would do.
        </p>
      )}
    </section>
  )
}
