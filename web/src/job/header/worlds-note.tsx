/** That a job is robust: in how many worlds it judges designs, and by what. */

import type { Job, TuningWorlds } from '../../api/types'
import { formatCount, formatExact, percent } from '../../format/number'

export function WorldsNote({ job }: { job: Job }) {
  const worlds = job.spec.kind === 'tuning' ? job.spec.worlds : null
  if (!worlds) return null
  const { count, seed, ranges } = worlds
  return (
    <p class="small" data-worlds={count}>
      <strong>Robust job</strong>: every design walks in {formatCount(count)} world
      {count === 1 ? '' : 's'} that differ from the model
      {ranges && ` in ${formatCount(ranges.length)} perturbations`}, drawn with seed {seed}. A
      scenario counts by {judgedBy(worlds)}.
    </p>
  )
}

/** What utilities in many worlds come to, in words. */
function judgedBy({ aggregate, level = 0.75 }: TuningWorlds): string {
  switch (aggregate) {
    case 'mean':
      return 'the mean of its utilities in all of them'
    case 'quantile':
      return `the ${percent(level, 2)} quantile of its utilities`
    case 'worst':
      return 'the worst of its utilities'
    default:
      return `the conditional value at risk of its utilities: the mean of the worst ${formatExact(
        (1 - level) * 100,
        3,
      )} %`
  }
}
