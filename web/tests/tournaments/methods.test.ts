import { expect, test } from 'vitest'
import type { TournamentStandings } from '../../src/api/types'
import {
  COLOURS,
  isUnderWay,
  rankedMethods,
  runCount,
  toggled,
} from '../../src/tournaments/methods'

function standings(ranks: Record<string, number>): TournamentStandings {
  const entrants = Object.keys(ranks).map((label) => ({ label, job: `job-${label}` }))
  const mean_ranks = Object.entries(ranks).map(([label, value]) => [label, { value }])
  return {
    mean_ranks: Object.fromEntries(mean_ranks),
    tournament: { entrants },
  } as unknown as TournamentStandings
}

const SEVEN = standings({ g: 7, a: 1, c: 3, b: 2, e: 5, d: 4, f: 6 })
const NONE = new URLSearchParams()

test('the best five have a colour, in the order of their ranks', () => {
  const methods = rankedMethods(SEVEN, NONE)
  expect(methods.map(({ label }) => label)).toEqual(['a', 'b', 'c', 'd', 'e', 'f', 'g'])
  expect(methods.map(({ colour }) => colour)).toEqual([...COLOURS, null, null])
})

test('an address chooses others, and each keeps its colour when one is added or taken back', () => {
  const chosen = (words: string) => rankedMethods(SEVEN, new URLSearchParams({ methods: words }))
  const methods = chosen('job-g,job-b')
  const coloured = methods.filter(({ colour }) => colour !== null)
  expect(coloured.map(({ label, colour }) => [label, colour])).toEqual([
    ['b', COLOURS[1]],
    ['g', COLOURS[0]],
  ])
  expect(toggled(methods, 'job-a', true)).toBe('job-g,job-b,job-a')
  expect(toggled(methods, 'job-g', false)).toBe('job-b')
  expect(chosen('').every(({ colour }) => colour === null)).toBe(true)
  expect(chosen('nobody').every(({ colour }) => colour === null)).toBe(true)
})

test('a tournament is under way while a job of it may have more runs', () => {
  const of = (...states: string[]) =>
    ({
      entrants: states.map((state) => ({ state, runs: 2, runs_planned: 3 })),
    }) as unknown as TournamentStandings['tournament']
  expect(isUnderWay(of('succeeded', 'failed', 'paused'))).toBe(false)
  expect(isUnderWay(of('succeeded', 'queued'))).toBe(true)
  expect(runCount(of('running', 'succeeded'))).toEqual({ ended: 4, planned: 6 })
})
