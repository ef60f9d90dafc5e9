/** Scale of force arrows. */

import type { Extent } from './extent'

/** Length of the largest arrow, as a share of the robot's span. */
const LONGEST = 0.47

/** Round numbers of newtons per grid cell. */
const STEPS = [1, 2, 5]

/** Newtons per grid cell, so that forces up to `largest` [N] remain visible. */
export function newtonsPerCell(largest: number, { cell, span }: Extent): number {
  if (!(largest > 0)) return 10
  const needed = (largest * cell) / (LONGEST * span)
  let power = 10 ** Math.floor(Math.log10(needed))
  for (;;) {
    for (const step of STEPS) if (step * power >= needed) return step * power
    power *= 10
  }
}

/** The 99th percentile of the values [N], which ignores short impacts. */
export function typicalLargest(norms: Float32Array): number {
  if (norms.length === 0) return 0
  const sorted = Float32Array.from(norms).sort()
  return sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * 0.99))]
}
