/** How often a design fails over worlds: in words, and as a histogram of the fitness. */

import { getBytes } from '../../api/client'
import { cached, useResource } from '../../api/resource'
import type { Certificate } from '../../api/types'
import { formatCount, formatExact, formatNumber, percent } from '../../format/number'
import { columnNamed, decodeParticles } from '../designs/particles'
import './failures.css'

const BINS = 28

/** Worlds of the histogram; more are thinned. */
const MOST = 2000

export function Failures({ certificate, id }: { certificate: Certificate; id: string }) {
  const { failed, fell, worlds, fitness } = certificate
  const key = `worlds ${id} ${worlds}`
  const fitnesses = useResource(
    key,
    () =>
      cached(key, () =>
        getBytes('/v1/jobs/{job_id}/particles', {
          path: { job_id: id },
          query: { max_points: MOST },
        }).then((bytes) => columnNamed(decodeParticles(bytes), 'fitness')!.values),
      ),
    { keep: true },
  )
  return (
    <div class="stack" data-failed={failed.count} data-fell={fell.count}>
      <h2>Fails in at most {percent(failed.high, 2)} of such worlds</h2>
      <p>
        A simulation failed in <strong>{formatCount(failed.count)}</strong> of {formatCount(worlds)}{' '}
        worlds
        {failed.count > 0 && <>; the robot fell in {formatCount(fell.count)}</>}. With 95&nbsp;%
        confidence, the probability of a failure is {percent(failed.low, 2)} to{' '}
        {percent(failed.high, 2)}.
      </p>
      {fitnesses.data && (
        <Histogram values={[...fitnesses.data]} nominal={fitness.nominal} failed={failed.count} />
      )}
    </div>
  )
}

interface HistogramProps {
  values: readonly number[]
  nominal: number | null
  failed: number
}

/** Worlds by fitness, the failed ones as the last bar. The first value is the nominal world. */
function Histogram({ values: [, ...values], nominal, failed }: HistogramProps) {
  const finite = values.filter(Number.isFinite)
  if (finite.length < 2) return null
  const [low, high] = [Math.min(...finite, nominal ?? Infinity), Math.max(...finite)]
  const counts = new Array<number>(BINS).fill(0)
  const binOf = (value: number) =>
    high > low ? Math.min(BINS - 1, Math.floor(((value - low) / (high - low)) * BINS)) : 0
  for (const value of finite) counts[binOf(value)] += 1
  const most = Math.max(...counts, values.length - finite.length)
  const height = (count: number) => `${(100 * count) / most}%`
  return (
    <figure>
      <div
        class="histogram-bars"
        role="img"
        aria-label={`Worlds by fitness, from ${formatNumber(low)} to ${formatNumber(high)}; ${formatCount(failed)} failed`}
      >
        {counts.map((count, k) => (
          <i
            key={k}
            style={{ height: height(count) }}
            data-nominal={nominal !== null && binOf(nominal) === k}
          />
        ))}
        <i data-failed style={{ height: height(values.length - finite.length) }} />
      </div>
      <div class="histogram-ends muted small" aria-hidden="true">
        <span>{formatExact(low, 4)}</span>
        <span>fitness; lower is better, marked: nominal world</span>
        <span>{formatExact(high, 4)}</span>
        <span>failed</span>
      </div>
    </figure>
  )
}
