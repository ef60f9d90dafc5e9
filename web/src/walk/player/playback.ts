/** Clock of a replay, independent of the browser. */

/** Playback speeds, as multiples of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const

type Listener = () => void

/** Tolerance for float32 times, as a share of a frame. */
const ROUNDING = 1e-3

export class Playback {
  private at = 0
  private moving = false
  private rate = 1
  private readonly listeners = new Set<Listener>()

  constructor(
    /** End of the longest walk [s]. */
    readonly duration: number,
    /** Recorded frames per second [Hz]. */
    readonly frameRate: number,
  ) {}

  /** Current time [s]. */
  get time(): number {
    return this.at
  }

  /** Current frame, from 0. */
  get frame(): number {
    return Math.floor(this.at * this.frameRate + ROUNDING)
  }

  get lastFrame(): number {
    return Math.floor(this.duration * this.frameRate + ROUNDING)
  }

  get playing(): boolean {
    return this.moving
  }

  get speed(): number {
    return this.rate
  }

  /** Start, from the beginning if at the end. */
  play(): void {
    if (this.duration <= 0) return
    if (this.at >= this.duration) this.at = 0
    this.moving = true
    this.changed()
  }

  pause(): void {
    if (!this.moving) return
    this.moving = false
    this.changed()
  }

  toggle(): void {
    if (this.moving) this.pause()
    else this.play()
  }

  setSpeed(speed: number): void {
    this.rate = Math.min(SPEEDS[SPEEDS.length - 1], Math.max(SPEEDS[0], speed))
    this.changed()
  }

  /** Advance by real time [s]; stops at the end. */
  advance(seconds: number): void {
    if (!this.moving) return
    this.at = Math.min(this.duration, this.at + seconds * this.rate)
    if (this.at >= this.duration) this.moving = false
    this.changed()
  }

  /** Seek to a time [s], clamped to the walk. */
  seek(time: number): void {
    this.at = Math.min(this.duration, Math.max(0, time))
    this.changed()
  }

  /** Stop, and move by a number of frames. */
  step(frames: number): void {
    this.moving = false
    const frame = Math.min(this.lastFrame, Math.max(0, this.frame + frames))
    this.at = Math.min(this.duration, frame / this.frameRate)
    this.changed()
  }

  /** Subscribe to changes; returns the unsubscribe function. */
  subscribe(listener: Listener): () => void {
    this.listeners.add(listener)
    return () => {
      this.listeners.delete(listener)
    }
  }

  private changed(): void {
    for (const listener of [...this.listeners]) listener()
  }
}
