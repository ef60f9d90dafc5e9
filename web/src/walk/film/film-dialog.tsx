/** Dialog to record a replay as a video. */

import { useEffect, useId, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { Progress } from '../../components/progress'
import { fileStem } from '../../export/csv'
import { saveFile } from '../../export/save'
import type { Playback } from '../player/playback'
import { SpeedField } from '../player/player-controls'
import { usePlaybackState, usePlaybackTime } from '../player/use-playback'
import { filmType } from './film'

/** [px] */
export type FilmSize = readonly [width: number, height: number]

const SIZES: readonly FilmSize[] = [
  [640, 360],
  [1280, 720],
  [1920, 1080],
]

export function FilmDialog({
  playback,
  onRecord,
  onClose,
}: {
  playback: Playback
  /** Rejects with the error, or with the signal's reason. */
  onRecord: (size: FilmSize, type: string, signal: AbortSignal) => Promise<Blob>
  onClose: () => void
}) {
  const dialog = useRef<HTMLDialogElement>(null)
  const [chosen, setChosen] = useState(1)
  const [recording, setRecording] = useState<AbortController | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  const { speed } = usePlaybackState(playback)
  const type = filmType()
  const id = useId()
  useEffect(() => dialog.current!.showModal(), [])
  useEffect(() => () => recording?.abort(), [recording])
  const record = async () => {
    const abort = new AbortController()
    setRecording(abort)
    setFailure(null)
    try {
      const video = await onRecord(SIZES[chosen], type!, abort.signal)
      saveFile(
        video,
        `${fileStem('walk', new URLSearchParams(location.search).get('scenario') ?? '')}.webm`,
      )
      dialog.current?.close()
    } catch (error) {
      if (!abort.signal.aborted) setFailure(messageOf(error))
    }
    setRecording(null)
  }
  const seconds = playback.duration / speed
  return (
    <dialog ref={dialog} aria-labelledby={`${id}-title`} onClose={onClose}>
      <h2 id={`${id}-title`}>Save as video</h2>
      <div class="stack-tight">
        {type === null ? (
          <p class="notice" data-tone="warn" role="alert">
            This browser cannot record WebM video. Use a current Firefox or Chromium-based browser.
          </p>
        ) : recording ? (
          <Recorded playback={playback} />
        ) : (
          <>
            <p>
              The replay is recorded in real time, as currently displayed. Recording takes{' '}
              {seconds.toFixed(1)}&nbsp;s, the length of the video.
            </p>
            <div class="row">
              <SpeedField playback={playback} speed={speed} />
              <span class="speed">
                <label for={`${id}-size`}>Size</label>
                <select
                  id={`${id}-size`}
                  value={String(chosen)}
                  onChange={(event) => setChosen(Number(event.currentTarget.value))}
                >
                  {SIZES.map(([width, height], k) => (
                    <option key={width} value={String(k)}>
                      {width} × {height}
                    </option>
                  ))}
                </select>
              </span>
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
        {type !== null && !recording && (
          <button type="button" class="primary" onClick={record}>
            Record
          </button>
        )}
      </div>
    </dialog>
  )
}

function Recorded({ playback }: { playback: Playback }) {
  const time = usePlaybackTime(playback, 200)
  return (
    <>
      <p>
        {time.toFixed(1)} of {playback.duration.toFixed(1)}&nbsp;s recorded. Keep this tab visible;
        recording pauses while it is hidden.
      </p>
      <Progress done={time} planned={playback.duration} label="Recorded [s]" />
    </>
  )
}
