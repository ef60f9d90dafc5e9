/** The walk of a job's best design beside its figures; loaded when the page has come to rest. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { useSlowly } from '../../api/resource'
import type { Job } from '../../api/types'
import { useVisible } from '../../components/use-visible'
import { lazyPage } from '../../router/lazy-page'
import { withQuery } from '../../router/routes'
import '../../walk/player/walk-stage.css'

const BestWalk = lazyPage('the walk', () => import('./best-walk'))

/** After what comes first [ms]. */
const REST_MS = 1200
/** How often a running job's newer best is walked [ms]. */
const RENEW_MS = 30_000

export function WalkPreview({ job }: { job: Job }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [wanted, setWanted] = useState(false)
  const best = useSlowly(job.best_iteration ?? 0, RENEW_MS)
  useEffect(() => {
    if (wanted || !visible || matchMedia('(prefers-reduced-motion: reduce)').matches) return
    const timer = setTimeout(() => setWanted(true), REST_MS)
    return () => clearTimeout(timer)
  }, [visible, wanted])
  return (
    <div class="walk-preview" ref={box} data-wanted={wanted}>
      {wanted ? (
        <BestWalk job={job} best={best} visible={visible} />
      ) : (
        <div class="walk-preview-stage">
          <button type="button" onClick={() => setWanted(true)}>
            Show its walk
          </button>
        </div>
      )}
      <a class="small" href={withQuery('/walk', { job: job.id })}>
        The whole walk, with its numbers
      </a>
    </div>
  )
}
