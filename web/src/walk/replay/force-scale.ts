/** How long a force is drawn. */

import type { Extent } from './extent'

/** Length that the largest force should nearly reach, as a share of the robot's span; a leg's. */
const LONGEST = 0.47

/** Round numbers of newtons for one cell of the ground's grid. */
const STEPS = [1, 2, 5]

/** Newtons that a cell stands for, so that forces up to `largest` [N] stay in view. */
export function newtonsPerCell(largest: number, { cell, span }: Extent): number {
  if (!(largest > 0)) return 10
  const needed = (largest * cell) / (LONGEST * span)
  let power = 10 ** Math.floor(Math.log10(needed))
  for (;;) {
    for (const step of STEPS) if (step * power >= needed) return step * power
    power *= 10
  }
}

/** The force that all but the rarest hundredth of the values stay under [N]; impacts are short. */
export function typicalLargest(norms: Float32Array): number {
  if (norms.length === 0) return 0
  const sorted = Float32Array.from(norms).sort()
  return sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * 0.99))]
}
