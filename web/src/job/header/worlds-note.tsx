/** Summary of a robust job's worlds. */

import type { Job, TuningWorlds } from '../../api/types'
import { formatCount, formatExact, percent } from '../../format/number'

export function WorldsNote({ job }: { job: Job }) {
  const worlds = job.spec.kind === 'tuning' ? job.spec.worlds : null
  if (!worlds) return null
  const { count, seed, ranges } = worlds
  return (
    <p class="small" data-worlds={count}>
      <strong>Robust job</strong>: every design is simulated in {formatCount(count)} world
      {count === 1 ? '' : 's'} with perturbed models
      {ranges && ` (${formatCount(ranges.length)} perturbations)`}, seed {seed}. The utility of a
      scenario is {judgedBy(worlds)}.
    </p>
  )
}

/** Description of the aggregation over worlds. */
function judgedBy({ aggregate, level = 0.75 }: TuningWorlds): string {
  switch (aggregate) {
    case 'mean':
      return 'the mean over all worlds'
    case 'quantile':
      return `the ${percent(level, 2)} quantile over all worlds`
    case 'worst':
      return 'the worst over all worlds'
    default:
      return `the conditional value at risk of its utilities: the mean of the worst ${formatExact(
        (1 - level) * 100,
        3,
      )} %`
  }
}
