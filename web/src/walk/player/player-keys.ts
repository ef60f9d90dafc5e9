/** What keys do to a replay. Pure but for the clock and the view that they act on. */

import type { Playback } from './playback'

/** The camera, as keys move it. */
export interface View {
  turn(around: number, up: number): void
  zoom(factor: number): void
}

const TURN = Math.PI / 24

/** Elements that have a use of their own for a key. */
const OWN_SPACE = 'button, a, input, select, textarea, summary'
const OWN_ARROWS = 'input, select, textarea, [role="tab"], [role="application"][data-own-keys]'

/** Do what a key says; returns whether it says something. */
export function pressed(
  key: string,
  shift: boolean,
  target: Element,
  playback: Playback,
  view: View | null,
): boolean {
  if (key === ' ') {
    if (target.closest(OWN_SPACE)) return false
    playback.toggle()
    return true
  }
  if (target.closest(OWN_ARROWS)) return false
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
