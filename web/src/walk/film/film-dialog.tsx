/** Asks how a replay is to be recorded, and tells how far it is. */

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
  /** Throws what goes wrong, or the signal's reason. */
  onRecord: (size: FilmSize, type: string, signal: AbortSignal) => Promise<Blob>
  onClose: () => void
}) {
  const dialog = useRef<HTMLDialogElement>(null)
  const [chosen, setChosen] = useState(1)
  const [recording, setRecording] = useState<AbortController | null>(null)
  const [wrong, setWrong] = useState<string | null>(null)
  const { speed } = usePlaybackState(playback)
  const type = filmType()
  const id = useId()
  useEffect(() => dialog.current!.showModal(), [])
  useEffect(() => () => recording?.abort(), [recording])
  const record = async () => {
    const begun = new AbortController()
    setRecording(begun)
    setWrong(null)
    try {
      const video = await onRecord(SIZES[chosen], type!, begun.signal)
      saveFile(
        video,
        `${fileStem('walk', new URLSearchParams(location.search).get('scenario') ?? '')}.webm`,
      )
      dialog.current?.close()
    } catch (error) {
      if (!begun.signal.aborted) setWrong(messageOf(error))
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
            This browser cannot record a picture that moves as WebM. Firefox, Chromium and their kin
            can.
          </p>
        ) : recording ? (
          <Recorded playback={playback} />
        ) : (
          <>
            <p>
              The walk is played once over, as it is seen now, and recorded meanwhile. It takes{' '}
              {seconds.toFixed(1)}&nbsp;s, as long as the video will last.
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
        {wrong !== null && (
          <p class="notice" data-tone="bad" role="alert">
            It was not recorded: {wrong}
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
        {time.toFixed(1)} of {playback.duration.toFixed(1)}&nbsp;s of the walk are recorded. Leave
        this tab in view: hidden, it waits.
      </p>
      <Progress done={time} planned={playback.duration} label="Recorded [s]" />
    </>
  )
}
