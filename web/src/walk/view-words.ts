/** What a replay shows, as parts of an address. Pure. */

import type { Codec } from '../router/query-value'
import type { ViewChoices } from './player-controls'

/** What a replay shows where its address says nothing. */
export const USUAL_VIEW: ViewChoices = {
  arrangement: 'ghost',
  follow: true,
  forces: true,
  trail: true,
  meshes: true,
}

/** What differs from the usual, by its word. */
const WORDS: Readonly<Record<string, Partial<ViewChoices>>> = {
  beside: { arrangement: 'beside' },
  still: { follow: false },
  'no-forces': { forces: false },
  'no-trail': { trail: false },
  'no-meshes': { meshes: false },
}

/** `beside,no-trail` */
export const VIEW: Codec<ViewChoices> = {
  read: (text) => {
    const words = text.split(',')
    if (!words.every((word) => Object.hasOwn(WORDS, word))) return undefined
    return Object.assign({}, USUAL_VIEW, ...words.map((word) => WORDS[word]))
  },
  write: (choices) => {
    const differs = (change: Partial<ViewChoices>) =>
      Object.entries(change).every(([key, value]) => choices[key as keyof ViewChoices] === value)
    const words = Object.keys(WORDS).filter((word) => differs(WORDS[word]))
    return words.join(',') || null
  },
}

/** A moment [s]. */
export const MOMENT: Codec<number | null> = {
  read: (text) =>
    text !== '' && Number(text) >= 0 && Number.isFinite(Number(text)) ? Number(text) : undefined,
  write: (moment) => (moment ? String(Number(moment.toFixed(4))) : null),
}
