/** Identifier of a design in a job: `8.12` is design 12 of iteration 8. */

export interface Place {
  readonly iteration: number
  readonly particle: number
}

export function placeWord({ iteration, particle }: Place): string {
  return `${iteration}.${particle}`
}

/** Parse `8.12`; null for anything else. */
export function placeOf(word: string | null): Place | null {
  const match = /^(\d+)\.(\d+)$/.exec(word ?? '')
  return match && { iteration: Number(match[1]), particle: Number(match[2]) }
}
