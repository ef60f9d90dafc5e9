/** Data of charts that compare jobs, on a common x axis. */

import type { JobComparison } from '../api/types'
import type { ReferenceLine } from '../charts/lines/reference-line'
import { referenceLabel } from '../job/gain'

export type ComparedJob = JobComparison['jobs'][number]

/** Distinct reference fitness values of the jobs. */
export function referencesOf(jobs: readonly ComparedJob[]): readonly ReferenceLine[] {
  const references = new Map<string, ReferenceLine>()
  for (const { reference } of jobs) {
    if (typeof reference?.fitness !== 'number') continue
    const label = referenceLabel(reference)
    references.set(`${label} ${reference.fitness}`, { label, fitness: reference.fitness })
  }
  return [...references.values()]
}

const COLOURS = [1, 2, 3, 4, 5, 6].map((k) => `--series-${k}` as const)

export function colourOf(index: number): `--${string}` {
  return COLOURS[index % COLOURS.length]
}

/** Dash the lines whose colours repeat. */
export function dashOf(index: number): readonly number[] | undefined {
  return index < COLOURS.length ? undefined : [6, 4]
}

export type Axis = 'iterations' | 'evaluations' | 'seconds'

/** Best so far of every job on the union of their x values; null outside a job's range. */
export function convergences(jobs: readonly ComparedJob[], axis: Axis) {
  const places = jobs.map(({ convergence }) => convergence[axis])
  const x = union(places)
  const lines = jobs.map(({ convergence }, k) => held(x, places[k], convergence.best_so_far))
  return { x, lines }
}

/** Share of each job's designs with at most each fitness. */
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

/** Resample a step function: the value at the last position not after each x. */
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
