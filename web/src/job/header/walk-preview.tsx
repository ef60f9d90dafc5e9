/** Replay of a job's best design; loaded once the page is idle. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { useSlowly } from '../../api/resource'
import type { Job } from '../../api/types'
import { useVisible } from '../../components/use-visible'
import { lazyPage } from '../../router/lazy-page'
import { withQuery } from '../../router/routes'
import '../../walk/player/walk-stage.css'

const BestWalk = lazyPage('the walk', () => import('./best-walk'))

const REST_MS = 1200
const RENEW_MS = 30_000

export function WalkPreview({ job }: { job: Job }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [active, setActive] = useState(false)
  const best = useSlowly(job.best_iteration ?? 0, RENEW_MS)
  useEffect(() => {
    if (active || !visible || matchMedia('(prefers-reduced-motion: reduce)').matches) return
    const timer = setTimeout(() => setActive(true), REST_MS)
    return () => clearTimeout(timer)
  }, [visible, active])
  return (
    <div class="walk-preview" ref={box} data-loaded={active}>
      {active ? (
        <BestWalk job={job} best={best} visible={visible} />
      ) : (
        <div class="walk-preview-stage">
          <button type="button" onClick={() => setActive(true)}>
            Show the replay
          </button>
        </div>
      )}
      <a class="small" href={withQuery('/walk', { job: job.id })}>
        Full replay with plots
      </a>
    </div>
  )
}
