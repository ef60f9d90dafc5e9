/** Grouping of iterations, so that each group is visible. */

import type { DistributionItem } from '../../api/types'

export interface Strip {
  /** First and last iteration, and their middle. */
  readonly from: number
  readonly to: number
  readonly middle: number
  /** Mean of each quantile, ignoring iterations in which every design failed. */
  readonly fitness: readonly (number | null)[]
}

/** At most `most` strips of equal width; one per iteration if possible. */
export function grouped(items: readonly DistributionItem[], most: number): readonly Strip[] {
  const size = Math.max(1, Math.ceil(items.length / most))
  const strips: Strip[] = []
  for (let start = 0; start < items.length; start += size) {
    const group = items.slice(start, start + size)
    const [from, to] = [group[0].index, group[group.length - 1].index]
    const fitness = group[0].fitness.map((_, column) => mean(group.map((i) => i.fitness[column])))
    strips.push({ from, to, middle: (from + to) / 2, fitness })
  }
  return strips
}

function mean(values: readonly (number | null)[]): number | null {
  const present = values.filter((value) => value !== null)
  return present.length === 0
    ? null
    : present.reduce((sum, value) => sum + value, 0) / present.length
}
