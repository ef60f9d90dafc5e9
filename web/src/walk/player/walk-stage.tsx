/** A small looping replay, drawn while it is visible. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { useResource } from '../../api/resource'
import { useTheme } from '../../theme'
import { extentOf } from '../replay/extent'
import type { Recorded } from '../replay/recorded'
import type { Replay } from '../replay/replay'
import type { WalkScene } from '../scene/walk-scene'
import { Playback } from './playback'
import { ReplayDriver } from './replay-driver'
import { usePlaybackState } from './use-playback'
import './walk-stage.css'

/** Recorded frames per second [Hz]. */
export const RATE = 50
const OPTIONS = {
  arrangement: 'ghost',
  follow: true,
  forces: false,
  trail: false,
  meshes: true,
} as const

export function WalkStage({
  name,
  record,
  label,
  visible,
  onWalked,
}: {
  /** Identity of the walk; another name loads another walk. */
  name: string
  record: (signal: AbortSignal) => Promise<Recorded>
  /** Description for screen readers. */
  label: string
  visible: boolean
  /** Called when the walk has been loaded. */
  onWalked?: (replay: Replay) => void
}) {
  const walk = useResource(name, record)
  const { data } = walk
  useEffect(() => {
    if (data) onWalked?.(data.replay)
  }, [data])
  if (walk.error) {
    return (
      <div class="walk-preview-stage" role="alert">
        <p class="small">Could not load the walk. {messageOf(walk.error)}</p>
      </div>
    )
  }
  if (!walk.data) {
    return (
      <div class="walk-preview-stage" role="status">
        <p class="muted small">Simulating…</p>
      </div>
    )
  }
  if (walk.data.replay.frames === 0) {
    return (
      <div class="walk-preview-stage">
        <p class="muted small">There is nothing to show.</p>
      </div>
    )
  }
  return <Stage key={name} replay={walk.data.replay} label={label} visible={visible} />
}

function Stage({ replay, label, visible }: { replay: Replay; label: string; visible: boolean }) {
  const box = useRef<HTMLDivElement>(null)
  const [running, setRunning] = useState(
    () => !matchMedia('(prefers-reduced-motion: reduce)').matches,
  )
  const [failure, setFailure] = useState<string | null>(null)
  const playback = useMemo(() => new Playback(replay.end, RATE), [replay])
  const { playing } = usePlaybackState(playback)
  useScene(box, replay, label, playback, setFailure)
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

/** Draw the walk into the box. */
function useScene(
  box: { readonly current: HTMLDivElement | null },
  replay: Replay,
  label: string,
  playback: Playback,
  onFailure: (reason: string) => void,
) {
  const theme = useTheme()
  const scene = useRef<WalkScene | null>(null)
  const driver = useRef<ReplayDriver | null>(null)
  useEffect(() => {
    const stage = box.current!
    const drive = new ReplayDriver(playback, replay, stage)
    driver.current = drive
    let unmounted = false
    const observer = new ResizeObserver(() => {
      if (stage.clientWidth === 0 || stage.clientHeight === 0) return
      scene.current?.resize(stage.clientWidth, stage.clientHeight)
      drive.request()
    })
    import('../scene/walk-scene')
      .then(({ WalkScene }) => {
        if (unmounted) return
        const built = new WalkScene([replay], extentOf([replay]), 1, OPTIONS, () => drive.request())
        scene.current = built
        built.canvas.setAttribute('role', 'img')
        built.canvas.setAttribute('aria-label', label)
        stage.append(built.canvas)
        observer.observe(stage)
        drive.attach(built)
      })
      .catch((error: unknown) => !unmounted && onFailure(messageOf(error)))
    return () => {
      unmounted = true
      observer.disconnect()
      drive.dispose()
      scene.current?.dispose()
      scene.current = null
    }
  }, [replay, playback])
  useEffect(() => {
    scene.current?.recolour()
    driver.current?.request()
  }, [theme])
}
