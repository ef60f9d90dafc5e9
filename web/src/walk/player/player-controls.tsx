/** Playback and view controls of a replay. */

import { useId } from 'preact/hooks'
import { Segmented } from '../../components/fields/segmented'
import { formatExact } from '../../format/number'
import type { ViewName } from '../scene/camera-rig'
import type { SceneOptions } from '../scene/walk-scene'
import { type Playback, SPEEDS } from './playback'
import { usePlaybackState, usePlaybackTime } from './use-playback'

export type ViewChoices = SceneOptions

const LOOKS: readonly { readonly view: ViewName; readonly label: string }[] = [
  { view: 'three-quarter', label: 'Reset view' },
  { view: 'side', label: 'Side' },
  { view: 'front', label: 'Front' },
  { view: 'top', label: 'Top' },
]

export function PlayerControls({
  playback,
  comparing,
  meshed,
  choices,
  onChoose,
  onLook,
  onFilm,
  onPicture,
}: {
  playback: Playback
  /** Whether two walks are compared. */
  comparing: boolean
  /** Whether meshes are available. */
  meshed: boolean
  choices: ViewChoices
  onChoose: (choices: ViewChoices) => void
  onLook: (view: ViewName) => void
  /** Null without a scene. */
  onFilm: (() => void) | null
  onPicture: (() => void) | null
}) {
  const set = (changes: Partial<ViewChoices>) => onChoose({ ...choices, ...changes })
  return (
    <div class="player-controls">
      <Transport playback={playback} />
      <div class="row">
        <Segmented
          label="Camera"
          value={choices.follow ? 'follow' : 'orbit'}
          options={[
            ['follow', 'Follow'],
            ['orbit', 'Fixed'],
          ]}
          onChoose={(value) => set({ follow: value === 'follow' })}
        />
        {comparing && (
          <Segmented
            label="Arrangement"
            value={choices.arrangement}
            options={[
              ['ghost', 'Ghost'],
              ['side-by-side', 'Side by side'],
            ]}
            onChoose={(arrangement) => set({ arrangement })}
          />
        )}
        <Check label="Forces" on={choices.forces} onChange={(forces) => set({ forces })} />
        <Check label="Trail" on={choices.trail} onChange={(trail) => set({ trail })} />
        {meshed && (
          <Check label="Meshes" on={choices.meshes} onChange={(meshes) => set({ meshes })} />
        )}
        <span class="row looks">
          {LOOKS.map(({ view, label }) => (
            <button key={view} type="button" class="compact" onClick={() => onLook(view)}>
              {label}
            </button>
          ))}
        </span>
        <button
          type="button"
          class="compact"
          disabled={onPicture === null}
          onClick={onPicture ?? undefined}
        >
          Save as picture
        </button>
        <button
          type="button"
          class="compact"
          disabled={onFilm === null}
          onClick={onFilm ?? undefined}
        >
          Save as video…
        </button>
      </div>
    </div>
  )
}

function Transport({ playback }: { playback: Playback }) {
  const { playing, speed } = usePlaybackState(playback)
  const time = usePlaybackTime(playback, 60)
  const frame = playback.frame
  const seconds = (value: number) => value.toFixed(2)
  return (
    <div class="transport">
      <button
        type="button"
        class="primary play"
        onClick={() => playback.toggle()}
        aria-keyshortcuts="Space"
      >
        {playing ? 'Pause' : 'Play'}
      </button>
      <button type="button" onClick={() => playback.step(-1)} aria-label="Previous frame">
        ‹
      </button>
      <button type="button" onClick={() => playback.step(1)} aria-label="Next frame">
        ›
      </button>
      <input
        type="range"
        min={0}
        max={playback.lastFrame}
        step={1}
        value={frame}
        aria-label="Time in the walk"
        aria-valuetext={`${seconds(time)} s, frame ${frame} of ${playback.lastFrame}`}
        onInput={(event) => {
          playback.seek(Number(event.currentTarget.value) / playback.frameRate)
        }}
      />
      <output class="moment">
        {seconds(time)} / {seconds(playback.duration)}&nbsp;s
      </output>
      <SpeedField playback={playback} speed={speed} />
    </div>
  )
}

/** Playback speed, as a multiple of real time. */
export function SpeedField({ playback, speed }: { playback: Playback; speed: number }) {
  const id = useId()
  return (
    <span class="speed">
      <label for={id} class="label">
        Speed
      </label>
      <select
        id={id}
        value={String(speed)}
        onChange={(event) => playback.setSpeed(Number(event.currentTarget.value))}
      >
        {SPEEDS.map((value) => (
          <option key={value} value={String(value)}>
            {formatExact(value)}×
          </option>
        ))}
      </select>
    </span>
  )
}

function Check({
  label,
  on,
  onChange,
}: {
  label: string
  on: boolean
  onChange: (on: boolean) => void
}) {
  return (
    <label class="check">
      <input
        type="checkbox"
        checked={on}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
      {label}
    </label>
  )
}
