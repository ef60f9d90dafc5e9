/** A replay as a film: played once over while the browser records what the canvas shows. */

import type { Playback } from '../player/playback'

/** Pictures a second, at most. */
const PICTURES = 30

/** Enough for thin lines to stay thin. */
const BITS_PER_PIXEL = 0.15

/** How often the first picture is drawn before the walk begins. */
const FIRST = 4

/** How long the last picture stays [ms]; the recorder must see it once. */
const LAST = 100

/** Best first. */
const TYPES = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm']

/** In which of the types this browser records canvases as WebM; null if in none. */
export function filmType(): string | null {
  if (typeof MediaRecorder === 'undefined') return null
  if (!('captureStream' in HTMLCanvasElement.prototype)) return null
  return TYPES.find((type) => MediaRecorder.isTypeSupported(type)) ?? null
}

/**
 * Play from the beginning to the end, at the clock's speed, and record what is drawn meanwhile.
 *
 * Real time counts: where pictures are drawn slowly there are fewer of them, and the walk is as fast as it
 * is to be. A hidden tab draws none; clock and recorder stand until it is seen again.
 *
 * Throws the signal's reason, or what the browser says.
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
  const over = new AbortController()
  recorder.ondataavailable = ({ data }) => parts.push(data)
  const recorded = new Promise<void>((resolve, reject) => {
    recorder.onstop = () => resolve()
    recorder.onerror = () => reject(new Error('The browser gave up recording.'))
    signal.addEventListener('abort', () => reject(signal.reason), { signal: over.signal })
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
  const leave = playback.subscribe(() => {
    if (playback.time < playback.duration || playback.playing) return
    document.removeEventListener('visibilitychange', follow)
    setTimeout(() => recorder.state !== 'inactive' && recorder.stop(), LAST)
  })
  document.addEventListener('visibilitychange', follow, { signal: over.signal })
  try {
    recorder.start()
    // The film begins with the first picture that the recorder gets, which must be of the beginning.
    for (let k = 0; k < FIRST; k++) {
      playback.seek(0)
      await Promise.race([new Promise(requestAnimationFrame), recorded])
    }
    playback.play()
    await recorded
    return new Blob(parts, { type: 'video/webm' })
  } finally {
    over.abort()
    leave()
    if (recorder.state !== 'inactive') recorder.stop()
    for (const track of stream.getTracks()) track.stop()
  }
}
