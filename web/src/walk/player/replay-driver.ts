/** Moves a scene by a clock: draws when something changed, and tells the page what is shown. */

import type { Replay } from '../replay/replay'
import type { WalkScene } from '../scene/walk-scene'
import type { Playback } from './playback'

/** Longest time that may pass between two pictures [s]; a tab in the background gets none. */
export const LONGEST_STEP = 0.1
/** While it is recorded, when the clock must keep real time however slowly pictures are drawn [s]. */
export const LONGEST_STEP_OF_FILM = 2

/** Time over which pictures are counted [s]. */
const COUNTED = 1

/**
 * Pictures are asked for only while the clock runs or after a change, so a paused replay costs
 * nothing. Works without a scene too: then the clock alone runs.
 */
export class ReplayDriver {
  longestStep = LONGEST_STEP
  private scene: WalkScene | null = null
  private requested = 0
  private before = 0
  private pictures = 0
  private countedFrom = 0
  private readonly leave: () => void

  constructor(
    private readonly playback: Playback,
    /** The walk whose body's place is told. */
    private readonly replay: Replay,
    /** Where the moment is told by data- attributes. */
    private readonly element: HTMLElement,
  ) {
    this.leave = playback.subscribe(() => {
      // Time that passes while it stands, such as of a hidden tab, is not made up for.
      if (!playback.playing) this.before = 0
      this.tell()
      this.request()
    })
    this.tell()
  }

  /** Draw with this scene from now on. */
  attach(scene: WalkScene | null): void {
    this.scene = scene
    this.request()
  }

  /** Draw once more, soon. */
  request(): void {
    this.requested ||= requestAnimationFrame((now) => this.draw(now / 1000))
  }

  dispose(): void {
    this.leave()
    cancelAnimationFrame(this.requested)
    this.scene = null
  }

  private draw(now: number): void {
    // Not cleared before the clock moved, so that its own notice asks for no further picture.
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

  /** Pictures a second, while it plays. */
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

  private tell(): void {
    const { playback, replay } = this
    const { dataset } = this.element
    const frame = replay.frameAt(playback.time)
    dataset.frame = String(frame)
    dataset.time = playback.time.toFixed(4)
    dataset.playing = String(playback.playing)
    ;['x', 'y', 'z'].forEach((axis, k) => {
      // Adding zero makes the negative zero of rounding a plain one.
      dataset[axis] = String(Number(replay.value('link_pose', frame, k).toFixed(4)) + 0)
    })
  }
}
