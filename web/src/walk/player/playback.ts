/** Clock of a replay, independent of the browser. */

import { useEffect, useState } from 'preact/hooks'
import { Changes } from '../../changes'

/** Playback speeds, as multiples of real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const

/** Tolerance for float32 times, as a share of a frame. */
const ROUNDING = 1e-3

export class Playback extends Changes {
  /** [s] */
  time = 0
  playing = false
  speed = 1

  constructor(
    /** End of the longest walk [s]. */
    readonly duration: number,
    /** Recorded frames per second [Hz]. */
    readonly frameRate: number,
  ) {
    super()
  }

  get frame(): number {
    return Math.floor(this.time * this.frameRate + ROUNDING)
  }

  get lastFrame(): number {
    return Math.floor(this.duration * this.frameRate + ROUNDING)
  }

  /** Start, from the beginning if at the end. */
  play(): void {
    if (this.duration <= 0) return
    if (this.time >= this.duration) this.time = 0
    this.playing = true
    this.notify()
  }

  pause(): void {
    if (!this.playing) return
    this.playing = false
    this.notify()
  }

  toggle(): void {
    if (this.playing) this.pause()
    else this.play()
  }

  setSpeed(speed: number): void {
    this.speed = Math.min(SPEEDS[SPEEDS.length - 1], Math.max(SPEEDS[0], speed))
    this.notify()
  }

  /** Advance by real time [s]; stops at the end. */
  advance(seconds: number): void {
    if (!this.playing) return
    this.time = Math.min(this.duration, this.time + seconds * this.speed)
    if (this.time >= this.duration) this.playing = false
    this.notify()
  }

  /** Seek to a time [s], clamped to the walk. */
  seek(time: number): void {
    this.time = Math.min(this.duration, Math.max(0, time))
    this.notify()
  }

  /** Stop, and move by a number of frames. */
  step(frames: number): void {
    this.playing = false
    const frame = Math.min(this.lastFrame, Math.max(0, this.frame + frames))
    this.seek(frame / this.frameRate)
  }
}

/** Time, speed and whether it plays; while it plays, the time at most every `milliseconds`. */
export function usePlayback(playback: Playback, milliseconds: number, active = true) {
  const { time, playing, speed } = playback
  const [state, setState] = useState({ time, playing, speed })
  useEffect(() => {
    if (!active) return
    let last = 0
    const update = () => {
      const { time, playing, speed } = playback
      const now = performance.now()
      setState((shown) => {
        const same = playing && shown.playing && speed === shown.speed
        if (same && now - last < milliseconds) return shown
        last = now
        return { time, playing, speed }
      })
    }
    update()
    return playback.subscribe(update)
  }, [playback, milliseconds, active])
  return state
}
