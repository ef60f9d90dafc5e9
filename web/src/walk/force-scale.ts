/** How long a force is drawn. */

/** Length that the largest force should nearly reach [m]; about a leg's. */
const LONGEST = 0.25

/** Round numbers of newtons for ten centimetres, one cell of the ground's grid. */
const STEPS = [1, 2, 5]

/** Newtons that ten centimetres stand for, so that forces up to `largest` [N] stay in view. */
export function newtonsPerCell(largest: number): number {
  if (!(largest > 0)) return 10
  const needed = (largest * 0.1) / LONGEST
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
