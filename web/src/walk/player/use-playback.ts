/** Playback as component state. */

import { useEffect, useState } from 'preact/hooks'
import type { Playback } from './playback'

/** Current time [s], updated at most every `milliseconds` while playing, otherwise at once. */
export function usePlaybackTime(playback: Playback, milliseconds: number, active = true): number {
  const [time, setTime] = useState(playback.time)
  useEffect(() => {
    if (!active) return
    let last = 0
    const update = () => {
      const now = performance.now()
      if (playback.playing && now - last < milliseconds) return
      last = now
      setTime(playback.time)
    }
    update()
    return playback.subscribe(update)
  }, [playback, milliseconds, active])
  return time
}

/** Whether it plays, and at which speed. */
export function usePlaybackState(playback: Playback): { playing: boolean; speed: number } {
  const [state, setState] = useState({ playing: playback.playing, speed: playback.speed })
  useEffect(() => {
    const update = () =>
      setState((s) =>
        s.playing === playback.playing && s.speed === playback.speed
          ? s
          : { playing: playback.playing, speed: playback.speed },
      )
    update()
    return playback.subscribe(update)
  }, [playback])
  return state
}
