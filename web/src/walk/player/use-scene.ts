/** Scene of walks in a box, animated by a playback. */

import type { RefObject } from 'preact'
import { useEffect, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { useTheme } from '../../theme'
import type { Extent } from '../replay/extent'
import type { Replay } from '../replay/replay'
import type { SceneOptions, WalkScene } from '../scene/walk-scene'
import type { Playback } from './playback'

/** Longest time step per frame [s], after a pause of a tab in the background. */
export const LONGEST_STEP = 0.1

interface Stage {
  /** Receives the canvas. */
  readonly box: RefObject<HTMLElement | null>
  /** Receives data attributes with the state, which tests read. */
  readonly element: RefObject<HTMLElement | null>
  readonly replays: readonly Replay[]
  readonly extent: Extent
  /** Force of an arrow per grid cell [N]. */
  readonly newtons: number
  readonly playback: Playback
  readonly options: SceneOptions
  /** Called before the first frame. */
  readonly onBuilt: (scene: WalkScene, signal: AbortSignal) => void
}

/** The scene once it is loaded, its driver, or why it cannot be drawn. */
export function useScene(stage: Stage) {
  const [scene, setScene] = useState<WalkScene | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  const [driver, setDriver] = useState<ReplayDriver | null>(null)
  const latest = useRef(stage)
  latest.current = stage
  const theme = useTheme()
  const { replays, playback, options } = stage
  useEffect(() => {
    const { extent, newtons } = latest.current
    const [box, element] = [stage.box.current!, stage.element.current!]
    const drive = new ReplayDriver(playback, replays[0], element)
    const leave = new AbortController()
    let built: WalkScene | null = null
    const fill = () => {
      if (!built || box.clientWidth === 0 || box.clientHeight === 0) return
      built.resize(box.clientWidth, box.clientHeight)
      drive.request()
    }
    const observer = new ResizeObserver(fill)
    setScene(null)
    setFailure(null)
    setDriver(drive)
    import('../scene/walk-scene')
      .then(({ WalkScene }) => {
        if (leave.signal.aborted) return
        built = new WalkScene(replays, extent, newtons, latest.current.options, () =>
          drive.request(),
        )
        box.append(built.canvas)
        fill()
        observer.observe(box)
        latest.current.onBuilt(built, leave.signal)
        drive.scene = built
        drive.request()
        setScene(built)
      })
      .catch((error: unknown) => !leave.signal.aborted && setFailure(messageOf(error)))
    return () => {
      leave.abort()
      observer.disconnect()
      drive.dispose()
      built?.dispose()
    }
  }, [replays, playback])
  useEffect(() => {
    scene?.setOptions(options)
    scene?.recolour()
    driver?.request()
  }, [scene, options, theme])
  return { scene, driver, failure }
}

/** Draws only while playing or after a change. Without a scene, just the clock runs. */
class ReplayDriver {
  longestStep = LONGEST_STEP
  scene: WalkScene | null = null
  private requested = 0
  private before = 0
  private readonly unsubscribe: () => void

  constructor(
    private readonly playback: Playback,
    /** The walk whose body position is published. */
    private readonly replay: Replay,
    private readonly element: HTMLElement,
  ) {
    this.unsubscribe = playback.subscribe(() => {
      // Time while paused, as in a hidden tab, is not made up for.
      if (!playback.playing) this.before = 0
      this.publish()
      this.request()
    })
    this.publish()
  }

  /** Schedule a redraw. */
  request(): void {
    this.requested ||= requestAnimationFrame((now) => this.draw(now / 1000))
  }

  dispose(): void {
    this.unsubscribe()
    cancelAnimationFrame(this.requested)
    this.scene = null
  }

  private draw(now: number): void {
    // Cleared after advancing, so that the clock's notification does not request another frame.
    if (this.playback.playing) {
      this.playback.advance(this.before === 0 ? 0 : Math.min(this.longestStep, now - this.before))
    }
    this.requested = 0
    this.scene?.show(this.playback.time)
    this.scene?.render()
    this.before = this.playback.playing ? now : 0
    if (this.playback.playing) this.request()
  }

  private publish(): void {
    const { playback, replay } = this
    const { dataset } = this.element
    const frame = replay.frameAt(playback.time)
    dataset.frame = String(frame)
    dataset.time = playback.time.toFixed(4)
    dataset.playing = String(playback.playing)
    for (const [k, axis] of ['x', 'y', 'z'].entries()) {
      // Adding zero turns -0 into 0.
      dataset[axis] = String(Number(replay.value('link_pose', frame, k).toFixed(4)) + 0)
    }
  }
}
