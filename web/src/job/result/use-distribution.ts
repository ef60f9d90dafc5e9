/** Distribution of fitness by iteration, extended as iterations are committed. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../../api/client'
import type { DistributionItem } from '../../api/types'

export interface Distribution {
  /** Quantile shares of the columns of `items[].fitness`. */
  readonly quantiles: readonly number[]
  readonly items: readonly DistributionItem[]
  readonly error: unknown
}

const EMPTY: Distribution = { quantiles: [], items: [], error: null }

/** committed: number of iterations; missing ones are loaded, one request at a time. */
export function useDistribution(id: string, committed: number): Distribution {
  const [distribution, setDistribution] = useState(EMPTY)
  const latest = useRef(EMPTY)
  const loading = useRef(false)
  const target = useRef(committed)
  target.current = committed

  useEffect(() => {
    if (loading.current) return
    loading.current = true
    const fill = async () => {
      while (latest.current.items.length < target.current) {
        const last = latest.current.items.at(-1)?.index
        const page = await get('/v1/jobs/{job_id}/distribution', {
          path: { job_id: id },
          query: { after: last, limit: 1000 },
        })
        if (page.items.length === 0) return
        const items = [...latest.current.items, ...page.items]
        latest.current = { quantiles: page.quantiles, items, error: null }
        setDistribution(latest.current)
      }
    }
    fill()
      .catch((error: unknown) => setDistribution({ ...latest.current, error }))
      .finally(() => {
        loading.current = false
      })
  }, [id, committed])
  return distribution
}
