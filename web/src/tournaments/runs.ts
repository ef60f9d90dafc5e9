/** Runs on a problem as columns of charts. Pure. */

import type { ProblemRuns } from '../api/types'
import type { Band, Series } from '../charts/lines/line-chart'
import { OTHERS, type RankedMethod } from './methods'

/** Least value that a logarithmic axis shows; smaller ones, such as 0, are drawn there. */
const LEAST = 1e-9

export interface Drawn {
  readonly x: readonly number[]
  readonly series: readonly Series[]
  readonly bands: readonly Band[]
}

/** Median of the best so far by checkpoint, with quartiles of the methods in colour. */
export function convergence(found: ProblemRuns, methods: readonly RankedMethod[]): Drawn {
  const known = methods.filter(({ label }) => label in found.methods)
  const series: Series[] = acceptance(found, found.checkpoints.length)
  const bands: Band[] = []
  for (const { label, colour } of known) {
    const { lower, median, upper } = found.methods[label]
    if (colour === null) {
      series.push({ label, values: shown(median), colour: OTHERS, width: 0.8, silent: true })
      continue
    }
    const edge = { label: `${label}, quartile`, colour, width: 0, silent: true }
    bands.push({ upper: series.length, lower: series.length + 1, colour, opacity: 0.12 })
    series.push({ ...edge, values: shown(upper) }, { ...edge, values: shown(lower) })
    series.push({ label, values: shown(median), colour, width: 2 })
  }
  return { x: found.checkpoints, series, bands }
}

/**
 * A point for every run: its best, and the evaluations that finding it took (figs. 3.1 to 3.3).
 * The first and the last row have none, so that the axis spans the whole budget.
 */
export function cloud(found: ProblemRuns, methods: readonly RankedMethod[]): Drawn {
  const points = methods
    .filter(({ label }) => label in found.methods)
    .flatMap(({ label }, method) => {
      const { best, found_after } = found.methods[label]
      return best.flatMap((y, run) => {
        const x = found_after[run]
        return x === null || y === null ? [] : [{ x, y: Math.max(y, LEAST), method }]
      })
    })
    .sort((a, b) => a.x - b.x)
  const known = methods.filter(({ label }) => label in found.methods)
  const column = (method: number) => [
    null,
    ...points.map((p) => (p.method === method ? p.y : null)),
    null,
  ]
  const dots = known.map(
    ({ label, colour }, method): Series => ({
      label,
      values: column(method),
      colour: colour ?? OTHERS,
      dots: true,
      silent: true,
    }),
  )
  // Those in colour come last, on top of the others.
  const order = [...known.keys()].sort(
    (a, b) => Number(known[a].colour !== null) - Number(known[b].colour !== null),
  )
  return {
    x: [found.checkpoints[0], ...points.map(({ x }) => x), found.checkpoints.at(-1)!],
    series: [...acceptance(found, points.length + 2), ...order.map((method) => dots[method])],
    bands: [],
  }
}

function acceptance({ target }: ProblemRuns, length: number): Series[] {
  if (target === null || target <= 0) return []
  return [
    {
      label: 'target',
      values: Array(length).fill(target),
      colour: '--text-muted',
      width: 1,
      dash: [6, 4],
    },
  ]
}

function shown(values: readonly (number | null)[]): readonly (number | null)[] {
  return values.map((value) => (value === null ? null : Math.max(value, LEAST)))
}
