/** Which methods of a tournament are told apart by colour. Pure. */

import type { Tournament, TournamentStandings } from '../api/types'

/** As many as there are colours that can be told apart. */
export const COLOURS = [
  '--series-1',
  '--series-2',
  '--series-3',
  '--series-4',
  '--series-5',
] as const

export const MOST_COLOURED = COLOURS.length

/** Of all methods without a colour of their own. */
export const OTHERS = '--line-strong'

/** A method that has runs, best first. */
export interface RankedMethod {
  readonly label: string
  /** Id of its job, which stands for it in addresses. */
  readonly job: string
  /** Null for a method that is drawn among the others. */
  readonly colour: `--${string}` | null
}

/** Methods by mean rank; the best have a colour, or those of an address such as `?methods=ID,ID`. */
export function rankedMethods(
  { mean_ranks, tournament }: Pick<TournamentStandings, 'mean_ranks' | 'tournament'>,
  query: URLSearchParams,
): readonly RankedMethod[] {
  const jobs = new Map(tournament.entrants.map(({ label, job }) => [label, job]))
  const labels = Object.keys(mean_ranks).sort(
    (a, b) => (mean_ranks[a].value ?? Infinity) - (mean_ranks[b].value ?? Infinity),
  )
  const asked = query.get('methods')
  const chosen =
    asked === null
      ? labels.slice(0, MOST_COLOURED).map((label) => jobs.get(label))
      : asked.split(',').slice(0, MOST_COLOURED)
  return labels.map((label) => {
    const job = jobs.get(label) ?? ''
    const place = chosen.indexOf(job)
    return { label, job, colour: place < 0 ? null : COLOURS[place] }
  })
}

/** The address's word for the methods in colour after one was chosen or taken back. */
export function toggled(methods: readonly RankedMethod[], job: string, on: boolean): string {
  const coloured = methods
    .filter(({ colour }) => colour !== null)
    .sort((a, b) => COLOURS.indexOf(a.colour as never) - COLOURS.indexOf(b.colour as never))
    .map((method) => method.job)
  return (on ? [...coloured, job] : coloured.filter((each) => each !== job)).join(',')
}

/** Whether more runs may come. */
export function isUnderWay({ entrants }: Pick<Tournament, 'entrants'>): boolean {
  return entrants.some(({ state }) => ['queued', 'running', 'pausing'].includes(state))
}

/** Runs of all methods that have ended, and that are to be. */
export function runCount({ entrants }: Pick<Tournament, 'entrants'>): {
  readonly ended: number
  readonly planned: number
} {
  return {
    ended: entrants.reduce((sum, { runs }) => sum + runs, 0),
    planned: entrants.reduce((sum, { runs_planned }) => sum + runs_planned, 0),
  }
}
