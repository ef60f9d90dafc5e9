/** Keyboard control of a replay. */

import type { Playback } from './playback'

/** Camera movements. */
export interface View {
  turn(around: number, up: number): void
  zoom(factor: number): void
}

const TURN = Math.PI / 24

/** Elements that handle the keys themselves. */
const SPACE_TARGETS = 'button, a, input, select, textarea, summary'
const ARROW_TARGETS =
  'input, select, textarea, [role="tab"], [role="application"][data-handles-keys]'

/** Handle a key; returns whether it was handled. */
export function pressed(
  key: string,
  shift: boolean,
  target: Element,
  playback: Playback,
  view: View | null,
): boolean {
  if (key === ' ') {
    if (target.closest(SPACE_TARGETS)) return false
    playback.toggle()
    return true
  }
  if (target.closest(ARROW_TARGETS)) return false
  if (shift && view && turned(key, view)) return true
  switch (key) {
    case 'ArrowLeft':
      playback.step(-1)
      return true
    case 'ArrowRight':
      playback.step(1)
      return true
    case 'Home':
      playback.seek(0)
      return true
    case 'End':
      playback.seek(playback.duration)
      return true
    case '+':
    case '=':
      view?.zoom(1.15)
      return view !== null
    case '-':
      view?.zoom(1 / 1.15)
      return view !== null
    default:
      return false
  }
}

function turned(key: string, view: View): boolean {
  switch (key) {
    case 'ArrowLeft':
      view.turn(-TURN, 0)
      return true
    case 'ArrowRight':
      view.turn(TURN, 0)
      return true
    case 'ArrowUp':
      view.turn(0, TURN)
      return true
    case 'ArrowDown':
      view.turn(0, -TURN)
      return true
    default:
      return false
  }
}
