/** Where a design is in its job, in words as commands have them: `8.12` is design 12 of iteration 8. */

export interface Place {
  readonly iteration: number
  readonly particle: number
}

/** `24.7`: design 7 of iteration 24. */
export function placeWord({ iteration, particle }: Place): string {
  return `${iteration}.${particle}`
}

/** What `placeWord` wrote, or with a slash as in older addresses; null for anything else. */
export function placeOf(word: string | null): Place | null {
  const found = /^(\d+)[./](\d+)$/.exec(word ?? '')
  return found && { iteration: Number(found[1]), particle: Number(found[2]) }
}
