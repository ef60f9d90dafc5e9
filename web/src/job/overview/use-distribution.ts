/** The distribution of fitness by iteration, extended as iterations are committed. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get } from '../../api/client'
import type { DistributionItem } from '../../api/types'

export interface Distribution {
  /** Shares to which the columns of `items[].fitness` belong. */
  readonly quantiles: readonly number[]
  readonly items: readonly DistributionItem[]
  readonly error: unknown
}

const EMPTY: Distribution = { quantiles: [], items: [], error: null }

/** committed: iterations that there are; what is missing of them is asked for, once at a time. */
export function useDistribution(id: string, committed: number): Distribution {
  const [known, setKnown] = useState(EMPTY)
  const latest = useRef(EMPTY)
  const asking = useRef(false)
  const wanted = useRef(committed)
  wanted.current = committed

  useEffect(() => {
    if (asking.current) return
    asking.current = true
    const fill = async () => {
      while (latest.current.items.length < wanted.current) {
        const last = latest.current.items.at(-1)?.index
        const page = await get('/v1/jobs/{job_id}/distribution', {
          path: { job_id: id },
          query: { after: last, limit: 1000 },
        })
        if (page.items.length === 0) return
        const items = [...latest.current.items, ...page.items]
        latest.current = { quantiles: page.quantiles, items, error: null }
        setKnown(latest.current)
      }
    }
    fill()
      .catch((error: unknown) => setKnown({ ...latest.current, error }))
      .finally(() => {
        asking.current = false
      })
  }, [id, committed])
  return known
}
