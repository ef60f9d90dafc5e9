/** View of an empty store: a robot that walks, and three ways to begin. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { get, post } from '../api/client'
import { useResource } from '../api/resource'
import type { JobSpec } from '../api/types'
import { ErrorNotice } from '../components/feedback'
import { formatDuration } from '../format/time'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'
import { handOver, ROBOT_FILES } from '../submission/robot/job'
import './first-run.css'
import walk from './walk.svg?raw'

/** The job of `make demo`. */
const DEMO = { name: 'demo', iterations: 25, seed: 1 } as JobSpec

/** Small enough to be finished while one waits. */
const EXAMPLE = {
  name: 'example',
  optimizer: { name: 'pso', particles: 12 },
  iterations: 6,
  seed: 7,
} as JobSpec

const POLL_MS = 500

/** onBegin: whether a job is being started, after which the store is not empty. */
export default function FirstRun({ onBegin }: { onBegin: (begins: boolean) => void }) {
  const [waiting, setWaiting] = useState('')
  const [error, setError] = useState<unknown>(null)
  const estimate = useResource('demo', (signal) => post('/v1/estimates', { body: DEMO, signal }))
  const seconds = estimate.data?.seconds
  const left = useRef(false)
  useEffect(
    () => () => {
      left.current = true
    },
    [],
  )
  const run = (words: string, spec: JobSpec, until: (id: string) => Promise<void>) => {
    setWaiting(words)
    onBegin(true)
    setError(null)
    // The same key for every click: the job is not submitted twice.
    const headers = { 'Idempotency-Key': `first-run-${spec.name}` }
    post('/v1/jobs', { body: spec, headers })
      .then(async ({ id }) => {
        await until(id)
        if (!left.current) navigate(jobPath(id))
      })
      .catch((reason: unknown) => {
        setError(reason)
        onBegin(false)
      })
      .finally(() => setWaiting(''))
  }
  const ended = async (id: string) => {
    for (;;) {
      const { finished_at } = await get('/v1/jobs/{job_id}', { path: { job_id: id } })
      if (finished_at !== null || left.current) return
      await new Promise((resolve) => setTimeout(resolve, POLL_MS))
    }
  }
  const take = (file: File | undefined) => {
    if (!file) return
    handOver(file)
    navigate('/jobs/new?robot=own')
  }
  return (
    <section class="first-run" aria-labelledby="first-run">
      <h1 id="first-run">
        gaitswarm simulates your walking robot and finds how it walks faster, smoother and on less
        energy.
      </h1>
      <WalkPicture />
      <div class="doors">
        <button
          type="button"
          class="door primary"
          disabled={waiting !== ''}
          onClick={() => run('Starting the demo…', DEMO, async () => {})}
        >
          <strong>Run the demo</strong>
          <span>
            {seconds ? `about ${formatDuration(seconds)}` : 'about 20 s'}: tune the drives of
            Szabad(ka)-II and watch
          </span>
        </button>
        <label
          class="door"
          onDragOver={(event) => event.preventDefault()}
          onDrop={(event) => {
            event.preventDefault()
            take(event.dataTransfer?.files[0])
          }}
        >
          <strong>My robot</strong>
          <span>choose or drop its URDF, xacro or MJCF</span>
          <input
            type="file"
            class="visually-hidden"
            accept={ROBOT_FILES}
            onChange={(event) => take(event.currentTarget.files?.[0])}
          />
        </label>
        <button
          type="button"
          class="door"
          disabled={waiting !== ''}
          onClick={() => run('Computing a small job…', EXAMPLE, ended)}
        >
          <strong>Look around</strong>
          <span>a small finished job, computed now in a few seconds</span>
        </button>
      </div>
      <p class="muted" role="status">
        {waiting}
      </p>
      {error !== null && <ErrorNotice what="The job was not started." error={error} />}
      <p>
        <a href="/jobs/new">Set up a job step by step</a>
      </p>
    </section>
  )
}

/** A recorded walk; still where motion is to be reduced. */
function WalkPicture() {
  const box = useRef<HTMLDivElement>(null)
  const [moving, setMoving] = useState(
    () => !matchMedia('(prefers-reduced-motion: reduce)').matches,
  )
  useEffect(() => {
    const picture = box.current?.querySelector('svg')
    if (moving) picture?.unpauseAnimations()
    else picture?.pauseAnimations()
  }, [moving])
  return (
    <figure class="first-walk">
      <div
        ref={box}
        role="img"
        aria-label="Szabad(ka)-II, a robot with six legs, walking"
        dangerouslySetInnerHTML={{ __html: walk }}
      />
      <figcaption class="muted small">
        Szabad(ka)-II with the best of 625 designs that gaitswarm tried.{' '}
        <button type="button" class="compact plain" onClick={() => setMoving(!moving)}>
          {moving ? 'Pause' : 'Play'}
        </button>
      </figcaption>
    </figure>
  )
}
