/** The replay: a scene in three dimensions with its controls. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { messageOf } from '../api/problem'
import { formatExact } from '../format/number'
import { useTheme } from '../theme'
import { extentOf, lengthInWords } from './extent'
import { newtonsPerCell, typicalLargest } from './force-scale'
import type { Playback } from './playback'
import { PlayerControls, type ViewChoices } from './player-controls'
import { pressed } from './player-keys'
import { type Recorded, replaysOf } from './recorded'
import type { Replay } from './replay'
import { ReplayDriver } from './replay-driver'
import type { CameraPlace, ViewName } from './scene/camera-rig'
import type { WalkScene } from './scene/walk-scene'

export function Player({
  walks,
  playback,
  choices,
  onChoose,
  camera,
  onCamera,
}: {
  /** One walk, or two to be compared. */
  walks: readonly Recorded[]
  playback: Playback
  choices: ViewChoices
  onChoose: (choices: ViewChoices) => void
  /** Where it is at first; null for the usual place. */
  camera: CameraPlace | null
  onCamera: (camera: CameraPlace | null) => void
}) {
  const player = useRef<HTMLElement>(null)
  const stage = useRef<HTMLDivElement>(null)
  const scene = useRef<WalkScene | null>(null)
  const driver = useRef<ReplayDriver | null>(null)
  const [failure, setFailure] = useState<string | null>(null)
  /** Meshes that were loaded, and why there are none of a robot that should have some. */
  const [meshes, setMeshes] = useState(0)
  const [lost, setLost] = useState<string | null>(null)
  /** Choices as they are when something is loaded later. */
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
    setMeshes(0)
    setLost(null)
    import('./scene/walk-scene').then(
      ({ WalkScene }) => {
        if (leave.signal.aborted) return
        try {
          const built = new WalkScene(replaysOf(walks), extent, newtons, choices, () =>
            replayDriver.request(),
          )
          scene.current = built
          observer = shownIn(container, built, () => replayDriver.request())
          built.placeCamera(placed.current.camera, (place) => placed.current.onCamera(place))
          replayDriver.attach(built)
          built
            .loadMeshes(() => shown.current.meshes, leave.signal)
            .then((count) => {
              setMeshes(count)
              replayDriver.request()
            })
            .catch((error: unknown) => !leave.signal.aborted && setLost(messageOf(error)))
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
  }, [playback])

  const look = (view: ViewName) => {
    scene.current?.look(view)
    driver.current?.request()
  }
  return (
    <section class="card player" ref={player} aria-label="Replay" data-player data-meshes={meshes}>
      <div class="player-stage" ref={stage}>
        {failure !== null && <NoScene reason={failure} />}
      </div>
      <SceneLegend walks={walks} cell={extent.cell} newtons={newtons} choices={choices} />
      {lost !== null && <p class="muted small">Meshes cannot be loaded: {lost}</p>}
      <PlayerControls
        playback={playback}
        comparing={walks.length > 1}
        meshed={meshes > 0}
        choices={choices}
        onChoose={onChoose}
        onLook={look}
      />
    </section>
  )
}

function NoScene({ reason }: { reason: string }) {
  return (
    <div class="notice" data-tone="warn" role="alert">
      <strong>The walk cannot be drawn in three dimensions here.</strong>
      <p>
        {reason} Switch on hardware acceleration or WebGL in the browser's settings. The clock and
        the plots below work without it.
      </p>
    </div>
  )
}

function SceneLegend({
  walks,
  cell,
  newtons,
  choices,
}: {
  walks: readonly Recorded[]
  /** Of the grid [m]. */
  cell: number
  newtons: number
  choices: ViewChoices
}) {
  const { ground, load_kg } = walks[0].replay.header
  return (
    <div class="legend">
      {walks.map(({ label }, k) => (
        <span key={k}>
          <i class={`swatch walk-${k + 1}`} aria-hidden="true" />
          {label}
          {k > 0 && choices.arrangement === 'ghost' ? ' (ghost)' : ''}
        </span>
      ))}
      <span>
        <i class="disc" aria-hidden="true" />
        foot on the ground
      </span>
      {choices.forces && (
        <span data-force-scale={newtons}>
          <i class="arrow" aria-hidden="true" />
          force of the ground, {lengthInWords(cell)} for {formatExact(newtons)}&nbsp;N
        </span>
      )}
      <span data-grid={cell}>grid of {lengthInWords(cell)}</span>
      {ground.slope_deg !== 0 && (
        <span data-slope={ground.slope_deg}>
          slope of {formatExact(Math.abs(ground.slope_deg))}°,{' '}
          {ground.slope_deg > 0 ? 'rising' : 'falling'} {towards(ground.slope_direction_deg)}
        </span>
      )}
      {load_kg > 0 && <span data-load={load_kg}>load of {formatExact(load_kg)}&nbsp;kg</span>}
    </div>
  )
}

function towards(degrees: number): string {
  if (degrees === 0) return 'ahead'
  return `${Math.abs(degrees)}° to the ${degrees > 0 ? 'left' : 'right'}`
}

/** Size of the forces that arrows must show [N]. */
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

/** Put a scene's canvas into a box and keep it as large as that. */
function shownIn(box: HTMLElement, scene: WalkScene, redraw: () => void): ResizeObserver {
  const { canvas } = scene
  canvas.tabIndex = 0
  canvas.setAttribute('role', 'application')
  canvas.setAttribute(
    'aria-label',
    'The robot in three dimensions. Space plays, arrow keys step by frame, shift with arrow keys' +
      ' turns the view, plus and minus zoom. The same numbers are in the charts below.',
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
