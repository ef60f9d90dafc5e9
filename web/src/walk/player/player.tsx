/** Replay in three dimensions with its controls. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { fileStem } from '../../export/csv'
import { saveFile } from '../../export/save'
import { formatExact } from '../../format/number'
import { pageName } from '../../router/breadcrumbs'
import { extentOf, lengthInWords, newtonsPerCell, typicalLargest } from '../replay/extent'
import { hasMeshes, type Recorded } from '../replay/replay'
import type { CameraPlace } from '../scene/camera-rig'
import type { SceneOptions, WalkScene } from '../scene/walk-scene'
import { FilmDialog, type FilmSize, film } from './film'
import type { Playback } from './playback'
import { PlayerControls } from './player-controls'
import { pressed } from './player-keys'
import { LONGEST_STEP, NoScene, useScene } from './use-scene'

/** Pixels of a saved picture per CSS pixel. */
const PIXELS = 2

/** During recording, the clock must keep real time however slow the drawing is [s]. */
const LONGEST_STEP_OF_FILM = 2

interface PlayerProps {
  /** One walk, or two to compare. */
  walks: readonly Recorded[]
  playback: Playback
  options: SceneOptions
  onOptions: (options: SceneOptions) => void
  camera: CameraPlace | null
  onCamera: (camera: CameraPlace | null) => void
}

export function Player({ walks, playback, options, onOptions, camera, onCamera }: PlayerProps) {
  const element = useRef<HTMLElement>(null)
  const box = useRef<HTMLDivElement>(null)
  const [filming, setFilming] = useState(false)
  const [pictureError, setPictureError] = useState<string | null>(null)
  /** Number of loaded meshes, null while loading, or the error of loading them. */
  const [meshes, setMeshes] = useState<number | string | null>(null)
  const latest = useRef({ options, onCamera })
  latest.current = { options, onCamera }
  const { replays, extent, newtons } = useMemo(() => {
    const replays = walks.map(({ replay }) => replay)
    const extent = extentOf(replays)
    const forces = replays.map((replay) => typicalLargest(replay.forces()))
    return { replays, extent, newtons: newtonsPerCell(Math.max(...forces), extent) }
  }, [walks])

  const onBuilt = (scene: WalkScene, signal: AbortSignal) => {
    setMeshes(null)
    scene.canvas.tabIndex = 0
    scene.canvas.setAttribute('role', 'application')
    scene.canvas.setAttribute(
      'aria-label',
      'The robot in three dimensions. Space plays or pauses, arrow keys step by frame, shift with arrow' +
        ' keys rotates the view, plus and minus zoom. The charts below show the same data.',
    )
    scene.placeCamera(camera, (place) => latest.current.onCamera(place))
    scene
      .loadMeshes(() => latest.current.options.meshes, signal)
      .then(setMeshes)
      .catch((error: unknown) => !signal.aborted && setMeshes(messageOf(error)))
  }
  const stage = { box, element, replays, extent, newtons, playback, options, onBuilt }
  const { scene, driver, failure } = useScene(stage)
  useEffect(() => driver?.request(), [meshes])

  useEffect(() => {
    if (filming) return
    const onKey = (event: KeyboardEvent) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return
      const target = event.target as Element
      const idle = target === document.body || target.id === 'main'
      if (!idle && !element.current?.contains(target)) return
      const rig = scene?.rig ?? null
      if (pressed(event.key, event.shiftKey, target, playback, rig)) event.preventDefault()
    }
    addEventListener('keydown', onKey)
    return () => removeEventListener('keydown', onKey)
  }, [playback, scene, filming])

  const record = async (size: FilmSize, signal: AbortSignal) => {
    const [shot, drive, before] = [scene!, driver!, playback.time]
    shot.film(size)
    drive.longestStep = LONGEST_STEP_OF_FILM
    try {
      return await film(shot.canvas, playback, signal)
    } finally {
      drive.longestStep = LONGEST_STEP
      shot.film(null)
      playback.pause()
      playback.seek(before)
    }
  }
  const savePicture = async (shot: WalkScene) => {
    setPictureError(null)
    const { clientWidth, clientHeight } = shot.canvas
    try {
      const picture = await shot.picture([PIXELS * clientWidth, PIXELS * clientHeight])
      saveFile(picture, `${fileStem(pageName(), `${playback.time.toFixed(2)} s`)}.png`)
    } catch (error) {
      setPictureError(messageOf(error))
    }
    driver?.request()
  }
  const count = typeof meshes === 'number' ? meshes : 0
  return (
    <section class="card player" ref={element} aria-label="Replay" data-player data-meshes={count}>
      <div class="player-stage" ref={box}>
        {failure !== null && (
          <NoScene
            what="walk"
            reason={failure}
            rest="Playback and the plots below work without it."
          />
        )}
      </div>
      <SceneLegend walks={walks} cell={extent.cell} newtons={newtons} options={options} />
      {pictureError !== null && (
        <p class="wrong small">Could not save the picture: {pictureError}</p>
      )}
      {typeof meshes === 'string' && <p class="muted small">Could not load the meshes: {meshes}</p>}
      {meshes === 0 && replays.some(({ header }) => hasMeshes(header)) && (
        <p class="muted small">
          Simplified shapes: the server has no meshes for this robot’s URDF. Start it with{' '}
          <code>gaitswarm serve --robots FOLDER</code> to show those in the robot’s folder.
        </p>
      )}
      <PlayerControls
        playback={playback}
        comparing={walks.length > 1}
        meshed={count > 0}
        options={options}
        onOptions={onOptions}
        onLook={(view) => scene?.rig.look(view)}
        onFilm={scene && (() => setFilming(true))}
        onPicture={scene && (() => savePicture(scene))}
      />
      {filming && (
        <FilmDialog playback={playback} onRecord={record} onClose={() => setFilming(false)} />
      )}
    </section>
  )
}

interface SceneLegendProps {
  walks: readonly Recorded[]
  /** Grid spacing [m], and the force of an arrow of this length [N]. */
  cell: number
  newtons: number
  options: SceneOptions
}

export function SceneLegend({ walks, cell, newtons, options }: SceneLegendProps) {
  const { ground, load_kg } = walks[0].replay.header
  return (
    <div class="legend">
      {walks.map(({ label }, k) => (
        <span key={k}>
          <i class={`swatch walk-${k + 1}`} aria-hidden="true" />
          {label}
          {k > 0 && options.arrangement === 'ghost' ? ' (ghost)' : ''}
        </span>
      ))}
      <span>
        <i class="disc" aria-hidden="true" />
        foot on the ground
      </span>
      {options.support && (
        <span>
          <i class="swatch support-area" aria-hidden="true" />
          support polygon
        </span>
      )}
      {options.forces && (
        <span>
          <i class="arrow" aria-hidden="true" />
          ground reaction force, {lengthInWords(cell)} for {formatExact(newtons)}&nbsp;N
        </span>
      )}
      <span>{lengthInWords(cell)} grid</span>
      {ground.slope_deg !== 0 && (
        <span>
          {formatExact(Math.abs(ground.slope_deg))}° slope,{' '}
          {ground.slope_deg > 0 ? 'rising' : 'falling'} {towards(ground.slope_direction_deg)}
        </span>
      )}
      {load_kg > 0 && <span>{formatExact(load_kg)}&nbsp;kg load</span>}
    </div>
  )
}

function towards(degrees: number): string {
  if (degrees === 0) return 'forward'
  return `${Math.abs(degrees)}° to the ${degrees > 0 ? 'left' : 'right'}`
}
