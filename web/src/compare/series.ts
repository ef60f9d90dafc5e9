/** Lines of several jobs over one axis, which a chart of lines takes with the same x for all. Pure. */

import type { JobComparison } from '../api/types'
import type { ReferenceLine } from '../charts/lines/reference-line'
import { referenceLabel } from '../job/gain'

export type ComparedJob = JobComparison['jobs'][number]

/** What jobs of one measure are compared with, each once. */
export function referencesOf(jobs: readonly ComparedJob[]): readonly ReferenceLine[] {
  const found = new Map<string, ReferenceLine>()
  for (const { reference } of jobs) {
    if (typeof reference?.fitness !== 'number') continue
    const label = referenceLabel(reference)
    found.set(`${label} ${reference.fitness}`, { label, fitness: reference.fitness })
  }
  return [...found.values()]
}

const COLOURS = [1, 2, 3, 4, 5, 6].map((k) => `--series-${k}` as const)

export function colourOf(index: number): `--${string}` {
  return COLOURS[index % COLOURS.length]
}

/** Lines whose colours come again are dashed. */
export function dashOf(index: number): readonly number[] | undefined {
  return index < COLOURS.length ? undefined : [6, 4]
}

export type Axis = 'iterations' | 'evaluations' | 'seconds'

/** Best so far of every job where any has a point; null before its first and after its last. */
export function convergences(jobs: readonly ComparedJob[], axis: Axis) {
  const places = jobs.map(({ convergence }) => convergence[axis])
  const x = union(places)
  const lines = jobs.map(({ convergence }, k) => held(x, places[k], convergence.best_so_far))
  return { x, lines }
}

/** Share of each job's designs that are as good as each fitness, or better. */
export function distributions(jobs: readonly ComparedJob[]) {
  const x = union(jobs.map(({ fitness }) => fitness))
  const lines = jobs.map(({ fitness, shares }) => {
    if (fitness.length === 0) return x.map(() => null)
    return held(x, fitness, shares).map((share, k) =>
      share === null ? (x[k] < fitness[0] ? 0 : 1) : share,
    )
  })
  return { x, lines }
}

/** The value of the last place that is not after each x. */
function held(
  x: readonly number[],
  places: readonly number[],
  values: readonly (number | null)[],
): (number | null)[] {
  let next = 0
  return x.map((at) => {
    while (next < places.length && places[next] <= at) next++
    return next === 0 || at > places[places.length - 1] ? null : values[next - 1]
  })
}

function union(all: readonly (readonly number[])[]): number[] {
  return [...new Set(all.flat())].sort((a, b) => a - b)
}
