/** Recording of a replay as a video, and its dialog. */

import { useEffect, useId, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { Select } from '../../components/fields/controls'
import { Progress } from '../../components/state'
import { fileStem } from '../../export/csv'
import { saveFile } from '../../export/save'
import { type Playback, usePlayback } from './playback'
import { SpeedField } from './player-controls'

/** [px] */
export type FilmSize = readonly [width: number, height: number]

const SIZES: readonly FilmSize[] = [
  [640, 360],
  [1280, 720],
  [1920, 1080],
]

/** Largest frame rate [1/s]. */
const PICTURES = 30

/** Enough for thin lines to remain sharp. */
const BITS_PER_PIXEL = 0.15

/** How often the first frame is drawn before playback. */
const FIRST = 4

/** Duration of the last frame [ms], so that the recorder captures it. */
const LAST = 100

/** First supported type, MP4 if possible; undefined if there is none. */
function filmType(): string | undefined {
  if (typeof MediaRecorder === 'undefined') return undefined
  if (!('captureStream' in HTMLCanvasElement.prototype)) return undefined
  const types = [
    'video/mp4;codecs=avc1.640028',
    'video/mp4',
    'video/webm;codecs=vp9',
    'video/webm;codecs=vp8',
    'video/webm',
  ]
  return types.find((type) => MediaRecorder.isTypeSupported(type))
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
  signal: AbortSignal,
): Promise<Blob> {
  const stream = canvas.captureStream(PICTURES)
  const type = filmType()
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
    return new Blob(parts, { type: type?.split(';')[0] })
  } finally {
    finished.abort()
    unsubscribe()
    if (recorder.state !== 'inactive') recorder.stop()
    for (const track of stream.getTracks()) track.stop()
  }
}

interface FilmDialogProps {
  playback: Playback
  /** Rejects with the error, or with the signal's reason. */
  onRecord: (size: FilmSize, signal: AbortSignal) => Promise<Blob>
  onClose: () => void
}

export function FilmDialog({ playback, onRecord, onClose }: FilmDialogProps) {
  const dialog = useRef<HTMLDialogElement>(null)
  const [chosen, setChosen] = useState(1)
  const [recording, setRecording] = useState<AbortController | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  const { speed, time } = usePlayback(playback, 200)
  const isSupported = filmType() !== undefined
  const id = useId()
  useEffect(() => dialog.current!.showModal(), [])
  useEffect(() => () => recording?.abort(), [recording])
  const record = async () => {
    const abort = new AbortController()
    setRecording(abort)
    setFailure(null)
    try {
      const video = await onRecord(SIZES[chosen], abort.signal)
      const scenario = new URLSearchParams(location.search).get('scenario') ?? ''
      saveFile(video, `${fileStem('walk', scenario)}.${video.type.split('/')[1]}`)
      dialog.current?.close()
    } catch (error) {
      if (!abort.signal.aborted) setFailure(messageOf(error))
    }
    setRecording(null)
  }
  return (
    <dialog ref={dialog} aria-labelledby={`${id}-title`} onClose={onClose}>
      <h2 id={`${id}-title`}>Save as video</h2>
      <div class="stack-tight">
        {!isSupported ? (
          <p class="notice" data-tone="warn" role="alert">
            This browser cannot record video. Use a current Firefox or Chromium-based browser.
          </p>
        ) : recording ? (
          <>
            <p>
              {time.toFixed(1)} of {playback.duration.toFixed(1)}&nbsp;s recorded. Keep this tab
              visible; recording pauses while it is hidden.
            </p>
            <Progress done={time} planned={playback.duration} label="Recorded [s]" />
          </>
        ) : (
          <>
            <p>
              The replay is recorded in real time, as currently displayed. Recording takes{' '}
              {(playback.duration / speed).toFixed(1)}&nbsp;s, the length of the video.
            </p>
            <div class="row">
              <SpeedField playback={playback} speed={speed} />
              <Select
                label="Size"
                value={String(chosen)}
                options={SIZES.map(([width, height], k) => [String(k), `${width} × ${height}`])}
                onChoose={(k) => setChosen(Number(k))}
              />
            </div>
          </>
        )}
        {failure !== null && (
          <p class="notice" data-tone="bad" role="alert">
            Recording failed: {failure}
          </p>
        )}
      </div>
      <div class="actions">
        <button
          type="button"
          onClick={() => (recording ? recording.abort() : dialog.current!.close())}
        >
          {recording ? 'Stop recording' : 'Close'}
        </button>
        {isSupported && !recording && (
          <button type="button" class="primary" onClick={record}>
            Record
          </button>
        )}
      </div>
    </dialog>
  )
}
