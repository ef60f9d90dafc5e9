/** Recording of a replay as a video. */

import type { Playback } from '../player/playback'

/** Largest frame rate [1/s]. */
const PICTURES = 30

/** Enough for thin lines to remain sharp. */
const BITS_PER_PIXEL = 0.15

/** How often the first frame is drawn before playback. */
const FIRST = 4

/** Duration of the last frame [ms], so that the recorder captures it. */
const LAST = 100

/** In order of preference. */
const TYPES = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm']

/** First supported WebM type; null if there is none. */
export function filmType(): string | null {
  if (typeof MediaRecorder === 'undefined') return null
  if (!('captureStream' in HTMLCanvasElement.prototype)) return null
  return TYPES.find((type) => MediaRecorder.isTypeSupported(type)) ?? null
}

/**
 * Play from beginning to end in real time, and record the canvas. Slow drawing lowers the frame rate,
 * not the speed. In a hidden tab, playback and recording pause.
 *
 * Rejects with the signal's reason or the browser's error.
 */
export async function film(
  canvas: HTMLCanvasElement,
  playback: Playback,
  type: string,
  signal: AbortSignal,
): Promise<Blob> {
  signal.throwIfAborted()
  const stream = canvas.captureStream(PICTURES)
  const recorder = new MediaRecorder(stream, {
    mimeType: type,
    videoBitsPerSecond: BITS_PER_PIXEL * PICTURES * canvas.width * canvas.height,
  })
  const parts: Blob[] = []
  const finished = new AbortController()
  recorder.ondataavailable = ({ data }) => parts.push(data)
  const recorded = new Promise<void>((resolve, reject) => {
    recorder.onstop = () => resolve()
    recorder.onerror = () => reject(new Error('The browser aborted the recording.'))
    signal.addEventListener('abort', () => reject(signal.reason), { signal: finished.signal })
  })
  const follow = () => {
    if (document.hidden) {
      playback.pause()
      recorder.pause()
    } else {
      recorder.resume()
      playback.play()
    }
  }
  const unsubscribe = playback.subscribe(() => {
    if (playback.time < playback.duration || playback.playing) return
    document.removeEventListener('visibilitychange', follow)
    setTimeout(() => recorder.state !== 'inactive' && recorder.stop(), LAST)
  })
  document.addEventListener('visibilitychange', follow, { signal: finished.signal })
  try {
    recorder.start()
    // The first frame that the recorder receives must be the beginning.
    for (let k = 0; k < FIRST; k++) {
      playback.seek(0)
      await Promise.race([new Promise(requestAnimationFrame), recorded])
    }
    playback.play()
    await recorded
    return new Blob(parts, { type: 'video/webm' })
  } finally {
    finished.abort()
    unsubscribe()
    if (recorder.state !== 'inactive') recorder.stop()
    for (const track of stream.getTracks()) track.stop()
  }
}
