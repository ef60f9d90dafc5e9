/** The clock of a replay: which moment is shown, and whether it moves. Knows no browser. */

/** Slowest and fastest replay, as a share of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const

type Listener = () => void

/** Share of a frame by which moments, which come as float32, may be early. */
const ROUNDING = 1e-3

export class Playback {
  private at = 0
  private moving = false
  private rate = 1
  private readonly listeners = new Set<Listener>()

  constructor(
    /** End of the longest walk [s]. */
    readonly duration: number,
    /** Recorded frames a second [Hz]. */
    readonly frameRate: number,
  ) {}

  /** Moment that is shown [s]. */
  get time(): number {
    return this.at
  }

  /** Recorded frame that is shown, from 0. */
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

  /** Start, from the beginning if the end was reached. */
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

  /** Let real time pass [s]; stops at the end. */
  advance(seconds: number): void {
    if (!this.moving) return
    this.at = Math.min(this.duration, this.at + seconds * this.rate)
    if (this.at >= this.duration) this.moving = false
    this.changed()
  }

  /** Show a moment [s], the nearest within the walk. */
  seek(time: number): void {
    this.at = Math.min(this.duration, Math.max(0, time))
    this.changed()
  }

  /** Stop, and show the frame that lies so many frames further. */
  step(frames: number): void {
    this.moving = false
    const frame = Math.min(this.lastFrame, Math.max(0, this.frame + frames))
    this.at = Math.min(this.duration, frame / this.frameRate)
    this.changed()
  }

  /** Called after every change; returns what ends it. */
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
