/** Playback and view controls of a replay. */

import { Check, Segmented, Select } from '../../components/fields/controls'
import { formatExact } from '../../format/number'
import type { ViewName } from '../scene/camera-rig'
import type { SceneOptions } from '../scene/walk-scene'
import { type Playback, SPEEDS, usePlayback } from './playback'

const LOOKS: readonly (readonly [ViewName, string])[] = [
  ['three-quarter', 'Reset view'],
  ['side', 'Side'],
  ['front', 'Front'],
  ['top', 'Top'],
]

interface PlayerControlsProps {
  playback: Playback
  comparing: boolean
  meshed: boolean
  options: SceneOptions
  onOptions: (options: SceneOptions) => void
  onLook: (view: ViewName) => void
  /** Null without a scene. */
  onFilm: (() => void) | null
  onPicture: (() => void) | null
}

export function PlayerControls(props: PlayerControlsProps) {
  const { playback, comparing, meshed, options, onOptions, onLook, onFilm, onPicture } = props
  const check = (key: 'forces' | 'trail' | 'support' | 'meshes', label: string) => (
    <Check
      label={label}
      checked={options[key]}
      onChange={(shown) => onOptions({ ...options, [key]: shown })}
    />
  )
  return (
    <div class="player-controls">
      <Transport playback={playback} />
      <div class="row">
        <Segmented
          label="Camera"
          value={options.follow ? 'follow' : 'orbit'}
          options={[
            ['follow', 'Follow'],
            ['orbit', 'Fixed'],
          ]}
          onChoose={(value) => onOptions({ ...options, follow: value === 'follow' })}
        />
        {comparing && (
          <Segmented
            label="Arrangement"
            value={options.arrangement}
            options={[
              ['ghost', 'Ghost'],
              ['side-by-side', 'Side by side'],
            ]}
            onChoose={(arrangement) => onOptions({ ...options, arrangement })}
          />
        )}
        {check('forces', 'Forces')}
        {check('trail', 'Trail')}
        {check('support', 'Support')}
        {meshed && check('meshes', 'Meshes')}
        <span class="row looks">
          {LOOKS.map(([view, label]) => (
            <button key={view} type="button" class="compact" onClick={() => onLook(view)}>
              {label}
            </button>
          ))}
        </span>
        <button
          type="button"
          class="compact"
          disabled={!onPicture}
          onClick={onPicture ?? undefined}
        >
          Save as picture
        </button>
        <button type="button" class="compact" disabled={!onFilm} onClick={onFilm ?? undefined}>
          Save as video…
        </button>
      </div>
    </div>
  )
}

function Transport({ playback }: { playback: Playback }) {
  const { playing, speed, time } = usePlayback(playback, 60)
  const { frame, lastFrame, frameRate, duration } = playback
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
        max={lastFrame}
        step={1}
        value={frame}
        aria-label="Time in the walk"
        aria-valuetext={`${time.toFixed(2)} s, frame ${frame} of ${lastFrame}`}
        onInput={(event) => playback.seek(Number(event.currentTarget.value) / frameRate)}
      />
      <output class="moment">
        {time.toFixed(2)} / {duration.toFixed(2)}&nbsp;s
      </output>
      <SpeedField playback={playback} speed={speed} />
    </div>
  )
}

export function SpeedField({ playback, speed }: { playback: Playback; speed: number }) {
  return (
    <Select
      label="Speed"
      value={String(speed)}
      options={SPEEDS.map((value) => [String(value), `${formatExact(value)}×`])}
      onChoose={(value) => playback.setSpeed(Number(value))}
    />
  )
}
