/** A small looping replay, drawn while it is visible. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { useResource } from '../../api/resource'
import { extentOf } from '../replay/extent'
import type { Recorded, Replay } from '../replay/replay'
import type { WalkScene } from '../scene/walk-scene'
import { Playback, usePlayback } from './playback'
import { useScene } from './use-scene'
import './walk-stage.css'

/** Recorded frames per second [Hz]. */
export const RATE = 50

const OPTIONS = {
  arrangement: 'ghost',
  follow: true,
  forces: false,
  trail: false,
  support: true,
  meshes: true,
} as const

interface WalkStageProps {
  /** Identity of the walk; another name loads another walk. */
  name: string
  record: (signal: AbortSignal) => Promise<Recorded>
  label: string
  visible: boolean
  onWalked?: (replay: Replay) => void
}

export function WalkStage({ name, record, label, visible, onWalked }: WalkStageProps) {
  const { data, error } = useResource(name, record)
  useEffect(() => {
    if (data) onWalked?.(data.replay)
  }, [data])
  if (!error && data && data.replay.frames > 0) {
    return <Stage key={name} replay={data.replay} label={label} visible={visible} />
  }
  return (
    <div class="walk-preview-stage" role={error ? 'alert' : data ? undefined : 'status'}>
      {error ? (
        <p class="small">Could not load the walk. {messageOf(error)}</p>
      ) : (
        <p class="muted small">{data ? 'There is nothing to show.' : 'Simulating…'}</p>
      )}
    </div>
  )
}

function Stage({ replay, label, visible }: { replay: Replay; label: string; visible: boolean }) {
  const box = useRef<HTMLDivElement>(null)
  const [running, setRunning] = useState(
    () => !matchMedia('(prefers-reduced-motion: reduce)').matches,
  )
  const { replays, playback, extent } = useMemo(
    () => ({
      replays: [replay],
      playback: new Playback(replay.end, RATE),
      extent: extentOf([replay]),
    }),
    [replay],
  )
  const { playing } = usePlayback(playback, Number.POSITIVE_INFINITY)
  const onBuilt = ({ canvas }: WalkScene) => {
    canvas.setAttribute('role', 'img')
    canvas.setAttribute('aria-label', label)
  }
  const stage = { box, element: box, replays, extent, newtons: 1, playback, onBuilt }
  const { failure } = useScene({ ...stage, options: OPTIONS })
  useEffect(() => {
    // Draw only while visible; restart at the end.
    if (running && visible && !playing) playback.play()
    if (!(running && visible) && playing) playback.pause()
  }, [running, visible, playing, playback])
  return (
    <>
      <div class="walk-preview-stage" ref={box} data-stage>
        {failure !== null && (
          <p class="small" role="alert">
            Could not draw the walk in three dimensions. {failure}
          </p>
        )}
      </div>
      {failure === null && (
        <button type="button" class="compact" onClick={() => setRunning(!running)}>
          {running ? 'Pause' : 'Play'}
        </button>
      )}
    </>
  )
}
