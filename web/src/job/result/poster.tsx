/** A still of the best design's walk, replaced by its replay on demand. */

import { useRef, useState } from 'preact/hooks'
import { useResource } from '../../api/resource'
import type { Job, JobSpec } from '../../api/types'
import { useVisible } from '../../components/use-visible'
import { placeWord } from '../../format/place'
import { lazyPage } from '../../router/lazy-page'
import { jobPath } from '../../router/routes'
import { type Recorded, recordWalk } from '../../walk/replay/replay'
import { type Point, stillOf } from './still'

const BestWalk = lazyPage('the walk', () => import('./best-walk'))

/** Enough for the paths of the feet [Hz]. */
const RATE = 5

/** Simulate and record the best design in the first scenario. */
export function recordBest(job: Job, rate: number, signal: AbortSignal): Promise<Recorded> {
  const { robot, controller, scenarios } = job.spec as JobSpec
  const design = {
    label: job.name,
    robot,
    controller: { name: controller },
    design: job.best!.design,
  }
  // A stored spec has its presets resolved.
  return recordWalk(design, scenarios[0] as string, rate, signal)
}

export function WalkPoster({ job }: { job: Job }) {
  const box = useRef<HTMLDivElement>(null)
  const visible = useVisible(box)
  const [playing, setPlaying] = useState(false)
  const best = placeWord(job.best!)
  const walk = useResource(`${job.id} ${best}`, (signal) => recordBest(job, RATE, signal), {
    keep: true,
  })
  return (
    <div class="walk-preview" ref={box} data-loaded={playing}>
      {playing ? (
        <BestWalk job={job} best={job.best_iteration ?? 0} visible={visible} />
      ) : (
        <button type="button" class="walk-poster" onClick={() => setPlaying(true)}>
          {walk.data && walk.data.replay.frames > 1 && <Still {...stillOf(walk.data.replay)} />}
          <span class="walk-poster-play">
            <span aria-hidden="true">▶</span> Play the walk
          </span>
        </button>
      )}
      <a class="small" href={jobPath(job.id, 'walk')}>
        Open with charts
      </a>
    </div>
  )
}

function Still({ figures, paths, ground, box }: ReturnType<typeof stillOf>) {
  return (
    <svg viewBox={box} aria-hidden="true" preserveAspectRatio="xMidYMid meet">
      {paths.map((path, k) => (
        <polyline key={k} class="path" points={written(path)} />
      ))}
      <polygon class="support" points={written(ground)} />
      {figures.map(({ body, legs, opacity }, k) => (
        <g key={k} opacity={opacity}>
          {legs.map((leg, n) => (
            <polyline key={n} class="leg" points={written(leg)} />
          ))}
          <polygon class="body" points={written(body)} />
        </g>
      ))}
    </svg>
  )
}

function written(points: readonly Point[]): string {
  return points.map(([x, y]) => `${x.toFixed(4)},${y.toFixed(4)}`).join(' ')
}
