/** Animates a scene by a clock, and publishes the state as data attributes. */

import type { Replay } from '../replay/replay'
import type { WalkScene } from '../scene/walk-scene'
import type { Playback } from './playback'

/** Longest time step per frame [s], after a pause of a tab in the background. */
export const LONGEST_STEP = 0.1
/** During recording, the clock must keep real time however slow the drawing is [s]. */
export const LONGEST_STEP_OF_FILM = 2

/** Averaging time of the frame rate [s]. */
const COUNTED = 1

/** Draws only while playing or after a change. Without a scene, just the clock runs. */
export class ReplayDriver {
  longestStep = LONGEST_STEP
  private scene: WalkScene | null = null
  private requested = 0
  private before = 0
  private pictures = 0
  private countedFrom = 0
  private readonly unsubscribe: () => void

  constructor(
    private readonly playback: Playback,
    /** The walk whose body position is published. */
    private readonly replay: Replay,
    /** Element that receives the data attributes. */
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

  /** Set the scene to draw. */
  attach(scene: WalkScene | null): void {
    this.scene = scene
    this.request()
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
    if (this.scene) this.element.dataset.geometries = String(this.scene.geometries)
    this.count(now)
    this.before = this.playback.playing ? now : 0
    if (this.playback.playing) this.request()
  }

  /** Publish the frame rate during playback. */
  private count(now: number): void {
    if (!this.playback.playing || now - this.countedFrom > 2 * COUNTED) {
      this.pictures = 0
      this.countedFrom = now
    }
    this.pictures += 1
    if (now - this.countedFrom < COUNTED) return
    this.element.dataset.fps = ((this.pictures - 1) / (now - this.countedFrom)).toFixed(1)
    this.pictures = 1
    this.countedFrom = now
  }

  private publish(): void {
    const { playback, replay } = this
    const { dataset } = this.element
    const frame = replay.frameAt(playback.time)
    dataset.frame = String(frame)
    dataset.time = playback.time.toFixed(4)
    dataset.playing = String(playback.playing)
    ;['x', 'y', 'z'].forEach((axis, k) => {
      // Adding zero turns -0 into 0.
      dataset[axis] = String(Number(replay.value('link_pose', frame, k).toFixed(4)) + 0)
    })
  }
}
