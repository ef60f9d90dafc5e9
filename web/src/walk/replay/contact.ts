/** Stance phases of the feet. */

import type { Replay } from './replay'

/** Contact force threshold of a stance [N]. */
export const CONTACT_FORCE = 0.5

/** Stance phases of a foot [s]. */
export function stances(replay: Replay, leg: number): (readonly [from: number, to: number])[] {
  const spans: (readonly [number, number])[] = []
  let from: number | null = null
  for (let frame = 0; frame < replay.frames; frame++) {
    const stands = replay.force(frame, leg) > CONTACT_FORCE
    if (stands && from === null) from = replay.time(frame)
    if (!stands && from !== null) {
      spans.push([from, replay.time(frame)])
      from = null
    }
  }
  if (from !== null) spans.push([from, replay.end])
  return spans
}
