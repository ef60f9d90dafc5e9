/** Sparklines of the jobs' convergence. */

import { useRef } from 'preact/hooks'
import { get } from '../api/client'
import { useResource, useSlowly } from '../api/resource'
import type { Convergence, JobSummary } from '../api/types'

const POINTS = 24
const RENEW_MS = 8000
const WIDTH = 80
const HEIGHT = 20

export type Sparklines = ReadonlyMap<string, Convergence>

export function useSparklines(jobs: readonly JobSummary[]): Sparklines {
  const withResult = jobs.filter(({ best_fitness }) => best_fitness !== null)
  const iterations = withResult.reduce((sum, job) => sum + job.iterations, 0)
  const renewed = useSlowly(iterations, RENEW_MS)
  const ids = withResult.map(({ id }) => id)
  const convergences = useResource(ids.length === 0 ? null : `${ids.join()} ${renewed}`, (signal) =>
    get('/v1/job-convergences', { query: { job: ids, points: POINTS }, signal }),
  )
  const shown = useRef<Sparklines>(new Map())
  if (convergences.data)
    shown.current = new Map(convergences.data.items.map((item) => [item.id, item]))
  return shown.current
}

export function Sparkline({ line }: { line: Convergence | undefined }) {
  const points = (line?.best_so_far ?? []).flatMap((best, k) =>
    best !== null && best > 0 ? [[line!.evaluations[k], Math.log(best)] as const] : [],
  )
  if (points.length < 2) return null
  const [first, last] = [points[0], points.at(-1)!]
  const x = (value: number) => ((value - first[0]) / (last[0] - first[0] || 1)) * WIDTH
  const y = (value: number) => ((first[1] - value) / (first[1] - last[1] || 1)) * (HEIGHT - 2) + 1
  return (
    <svg class="sparkline" viewBox={`0 0 ${WIDTH} ${HEIGHT}`} aria-hidden="true">
      <polyline
        points={points.map(([a, b]) => `${x(a).toFixed(1)},${y(b).toFixed(1)}`).join(' ')}
      />
    </svg>
  )
}
