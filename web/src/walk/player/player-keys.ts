/** Keyboard control of a replay. */

import type { Playback } from './playback'

export interface View {
  turn(around: number, up: number): void
  zoom(factor: number): void
}

const TURN = Math.PI / 24
const ZOOM = 1.15

/** Elements that handle the keys themselves. */
const SPACE_TARGETS = 'button, a, input, select, textarea, summary'
const ARROW_TARGETS = 'input, select, textarea, [role="application"][data-handles-keys]'

const CLOCK: Readonly<Record<string, (playback: Playback) => void>> = {
  ' ': (playback) => playback.toggle(),
  ArrowLeft: (playback) => playback.step(-1),
  ArrowRight: (playback) => playback.step(1),
  Home: (playback) => playback.seek(0),
  End: (playback) => playback.seek(playback.duration),
}

const ZOOMS: Readonly<Record<string, number>> = { '+': ZOOM, '=': ZOOM, '-': 1 / ZOOM }

export const TURNS: Readonly<Record<string, readonly [around: number, up: number]>> = {
  ArrowLeft: [-TURN, 0],
  ArrowRight: [TURN, 0],
  ArrowUp: [0, TURN],
  ArrowDown: [0, -TURN],
}

/** Handle a key; returns whether it was handled. */
export function pressed(
  key: string,
  shift: boolean,
  target: Element,
  playback: Playback,
  view: View | null,
): boolean {
  if (target.closest(key === ' ' ? SPACE_TARGETS : ARROW_TARGETS)) return false
  if (view && shift && key in TURNS) view.turn(...TURNS[key])
  else if (view && key in ZOOMS) view.zoom(ZOOMS[key])
  else if (key in CLOCK) CLOCK[key](playback)
  else return false
  return true
}
