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

interface Drawing {
  readonly canvas: HTMLCanvasElement
  resize(width: number, height: number): void
  dispose(): void
}

type Box = RefObject<HTMLElement | null>

/** A scene as large as its box once its code is loaded, or why it cannot be drawn. */
export function useStage<S extends Drawing>(
  box: Box,
  load: () => Promise<() => S>,
  onBuilt: (scene: S, signal: AbortSignal) => void,
  inputs: readonly unknown[],
) {
  const [scene, setScene] = useState<S | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  useEffect(() => {
    const parent = box.current!
    const leave = new AbortController()
    let built: S | null = null
    const fill = () => {
      const { clientWidth, clientHeight } = parent
      if (clientWidth > 0 && clientHeight > 0) built?.resize(clientWidth, clientHeight)
    }
    const observer = new ResizeObserver(fill)
    setScene(null)
    setFailure(null)
    load()
      .then((build) => {
        if (leave.signal.aborted) return
        built = build()
        parent.append(built.canvas)
        fill()
        observer.observe(parent)
        onBuilt(built, leave.signal)
        setScene(built)
      })
      .catch((error: unknown) => !leave.signal.aborted && setFailure(messageOf(error)))
    return () => {
      leave.abort()
      observer.disconnect()
      built?.dispose()
    }
  }, inputs)
  return { scene, failure }
}

interface WalkStage {
  readonly box: Box
  /** Receives data attributes with the state, which tests read. */
  readonly element: Box
  readonly replays: readonly Replay[]
  readonly extent: Extent
  /** Force of an arrow per grid cell [N]. */
  readonly newtons: number
  readonly playback: Playback
  readonly options: SceneOptions
  readonly onBuilt: (scene: WalkScene, signal: AbortSignal) => void
}

/** A scene of walks animated by a playback, with its driver. */
export function useScene({ box, element, playback, options, replays, ...stage }: WalkStage) {
  const [driver, setDriver] = useState<ReplayDriver | null>(null)
  const theme = useTheme()
  useEffect(() => {
    const drive = new ReplayDriver(playback, replays[0], element.current!)
    setDriver(drive)
    return () => drive.dispose()
  }, [replays, playback])
  const latest = useRef(driver)
  latest.current = driver
  const load = async () => {
    const { WalkScene } = await import('../scene/walk-scene')
    const redraw = () => latest.current?.request()
    return () => new WalkScene(replays, stage.extent, stage.newtons, options, redraw)
  }
  const { scene, failure } = useStage(box, load, stage.onBuilt, [replays, playback])
  useEffect(() => {
    if (!driver || !scene) return
    driver.scene = scene
    scene.setOptions(options)
    scene.recolour()
    driver.request()
  }, [driver, scene, options, theme])
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

/** rest: what is possible without a scene. */
export function NoScene(props: { what: string; reason: string; rest: string }) {
  return (
    <div class="notice" data-tone="warn" role="alert">
      <strong>Could not draw the {props.what} in three dimensions.</strong>
      <p>
        {props.reason} Enable hardware acceleration or WebGL in the browser's settings. {props.rest}
      </p>
    </div>
  )
}
