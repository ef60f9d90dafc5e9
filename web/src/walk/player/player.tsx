/** Replay in three dimensions with its controls. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { messageOf } from '../../api/problem'
import { fileStem } from '../../export/csv'
import { saveFile } from '../../export/save'
import { useTheme } from '../../theme'
import { pageName } from '../../title'
import { film } from '../film/film'
import { FilmDialog, type FilmSize } from '../film/film-dialog'
import { extentOf, newtonsPerCell, typicalLargest } from '../replay/extent'
import { type Recorded, replaysOf } from '../replay/recorded'
import { hasMeshes, type Replay } from '../replay/replay'
import type { CameraPlace, ViewName } from '../scene/camera-rig'
import type { WalkScene } from '../scene/walk-scene'
import type { Playback } from './playback'
import { PlayerControls, type ViewChoices } from './player-controls'
import { pressed } from './player-keys'
import { LONGEST_STEP, LONGEST_STEP_OF_FILM, ReplayDriver } from './replay-driver'
import { SceneLegend } from './scene-legend'

/** Pixels of a saved picture per CSS pixel. */
const PIXELS = 2

export function Player({
  walks,
  playback,
  choices,
  onChoose,
  camera,
  onCamera,
}: {
  /** One walk, or two to compare. */
  walks: readonly Recorded[]
  playback: Playback
  choices: ViewChoices
  onChoose: (choices: ViewChoices) => void
  /** Initial camera; null for the default view. */
  camera: CameraPlace | null
  onCamera: (camera: CameraPlace | null) => void
}) {
  const player = useRef<HTMLElement>(null)
  const stage = useRef<HTMLDivElement>(null)
  const scene = useRef<WalkScene | null>(null)
  const driver = useRef<ReplayDriver | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  const [drawn, setDrawn] = useState(false)
  const [filming, setFilming] = useState(false)
  /** Error of saving a picture. */
  const [pictureError, setPictureError] = useState<string | null>(null)
  /** Number of loaded meshes, and the error of loading them. */
  const [meshes, setMeshes] = useState(0)
  const [meshError, setMeshError] = useState<string | null>(null)
  const [meshesLoaded, setMeshesLoaded] = useState(false)
  /** Current choices, for asynchronous loading. */
  const shown = useRef(choices)
  shown.current = choices
  const placed = useRef({ camera, onCamera })
  placed.current = { camera, onCamera }
  const theme = useTheme()
  const extent = useMemo(() => extentOf(replaysOf(walks)), [walks])
  const newtons = useMemo(
    () => newtonsPerCell(Math.max(...walks.map(({ replay }) => largestForce(replay))), extent),
    [walks, extent],
  )

  useEffect(() => {
    const replayDriver = new ReplayDriver(playback, walks[0].replay, player.current!)
    driver.current = replayDriver
    const container = stage.current!
    const leave = new AbortController()
    let observer: ResizeObserver | null = null
    setFailure(null)
    setDrawn(false)
    setMeshes(0)
    setMeshError(null)
    setMeshesLoaded(false)
    import('../scene/walk-scene').then(
      ({ WalkScene }) => {
        if (leave.signal.aborted) return
        try {
          const built = new WalkScene(replaysOf(walks), extent, newtons, choices, () =>
            replayDriver.request(),
          )
          scene.current = built
          setDrawn(true)
          observer = shownIn(container, built, () => replayDriver.request())
          built.placeCamera(placed.current.camera, (place) => placed.current.onCamera(place))
          replayDriver.attach(built)
          built
            .loadMeshes(() => shown.current.meshes, leave.signal)
            .then((count) => {
              setMeshes(count)
              setMeshesLoaded(true)
              replayDriver.request()
            })
            .catch((error: unknown) => !leave.signal.aborted && setMeshError(messageOf(error)))
        } catch (error) {
          setFailure(messageOf(error))
        }
      },
      (error: unknown) => !leave.signal.aborted && setFailure(messageOf(error)),
    )
    return () => {
      leave.abort()
      observer?.disconnect()
      replayDriver.dispose()
      scene.current?.dispose()
      scene.current = null
    }
  }, [walks, playback])

  useEffect(() => {
    scene.current?.setOptions(choices)
    driver.current?.request()
  }, [choices])

  useEffect(() => {
    scene.current?.recolour()
    driver.current?.request()
  }, [theme])

  useEffect(() => {
    if (filming) return
    const onKey = (event: KeyboardEvent) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return
      const target = event.target as Element
      const idle = target === document.body || target.id === 'main'
      if (!idle && !player.current?.contains(target)) return
      if (pressed(event.key, event.shiftKey, target, playback, scene.current)) {
        event.preventDefault()
      }
    }
    addEventListener('keydown', onKey)
    return () => removeEventListener('keydown', onKey)
  }, [playback, filming])

  const look = (view: ViewName) => {
    scene.current?.look(view)
    driver.current?.request()
  }
  const record = async (size: FilmSize, type: string, signal: AbortSignal) => {
    const [shot, drive, before] = [scene.current!, driver.current!, playback.time]
    shot.film(size)
    drive.longestStep = LONGEST_STEP_OF_FILM
    try {
      return await film(shot.canvas, playback, type, signal)
    } finally {
      drive.longestStep = LONGEST_STEP
      shot.film(null)
      playback.pause()
      playback.seek(before)
    }
  }
  const picture = async () => {
    setPictureError(null)
    const shot = scene.current!
    const { clientWidth, clientHeight } = shot.canvas
    const still = shot.picture([PIXELS * clientWidth, PIXELS * clientHeight])
    saveFile(await still, `${fileStem(pageName(), `${playback.time.toFixed(2)} s`)}.png`)
    driver.current?.request()
  }
  return (
    <section class="card player" ref={player} aria-label="Replay" data-player data-meshes={meshes}>
      <div class="player-stage" ref={stage}>
        {failure !== null && <NoScene reason={failure} />}
      </div>
      <SceneLegend walks={walks} cell={extent.cell} newtons={newtons} choices={choices} />
      {pictureError !== null && (
        <p class="wrong small">Could not save the picture: {pictureError}</p>
      )}
      {meshError !== null && <p class="muted small">Could not load the meshes: {meshError}</p>}
      {meshesLoaded && meshes === 0 && walks.some(({ replay }) => hasMeshes(replay.header)) && (
        <NoMeshes />
      )}
      <PlayerControls
        playback={playback}
        comparing={walks.length > 1}
        meshed={meshes > 0}
        choices={choices}
        onChoose={onChoose}
        onLook={look}
        onFilm={drawn ? () => setFilming(true) : null}
        onPicture={
          drawn ? () => picture().catch((error) => setPictureError(messageOf(error))) : null
        }
      />
      {filming && (
        <FilmDialog playback={playback} onRecord={record} onClose={() => setFilming(false)} />
      )}
    </section>
  )
}

function NoMeshes() {
  return (
    <p class="muted small">
      Simplified shapes: the server has no meshes for this robot’s URDF. Start it with{' '}
      <code>gaitswarm serve --robots FOLDER</code> to show those in the robot’s folder.
    </p>
  )
}

function NoScene({ reason }: { reason: string }) {
  return (
    <div class="notice" data-tone="warn" role="alert">
      <strong>Could not draw the walk in three dimensions.</strong>
      <p>
        {reason} Enable hardware acceleration or WebGL in the browser's settings. Playback and the
        plots below work without it.
      </p>
    </div>
  )
}

/** Largest force that arrows must represent [N]. */
function largestForce(replay: Replay): number {
  const legs = replay.header.robot.legs.length
  const sizes = new Float32Array(legs * replay.frames)
  for (let leg = 0; leg < legs; leg++) {
    for (let frame = 0; frame < replay.frames; frame++) {
      const force = [0, 1, 2].map((i) => replay.value('foot_force', frame, 3 * leg + i))
      sizes[leg * replay.frames + frame] = Math.hypot(...force)
    }
  }
  return typicalLargest(sizes)
}

/** Append a scene's canvas to a box and follow the size of the box. */
function shownIn(box: HTMLElement, scene: WalkScene, redraw: () => void): ResizeObserver {
  const { canvas } = scene
  canvas.tabIndex = 0
  canvas.setAttribute('role', 'application')
  canvas.setAttribute(
    'aria-label',
    'The robot in three dimensions. Space plays or pauses, arrow keys step by frame, shift with arrow' +
      ' keys rotates the view, plus and minus zoom. The charts below show the same data.',
  )
  box.append(canvas)
  const fill = () => {
    if (box.clientWidth === 0 || box.clientHeight === 0) return
    scene.resize(box.clientWidth, box.clientHeight)
    redraw()
  }
  fill()
  const observer = new ResizeObserver(fill)
  observer.observe(box)
  return observer
}
