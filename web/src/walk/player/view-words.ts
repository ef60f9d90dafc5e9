/** View of a replay as query values. */

import { type Codec, numbersOf } from '../../router/query-value'
import type { CameraPlace } from '../scene/camera-rig'
import type { SceneOptions } from '../scene/walk-scene'

export const DEFAULT_VIEW: SceneOptions = {
  arrangement: 'ghost',
  follow: true,
  forces: true,
  trail: true,
  support: true,
  meshes: true,
}

type Option = keyof SceneOptions

/** Deviations from the default, by word. */
const WORDS: Readonly<Record<string, Partial<SceneOptions>>> = {
  'side-by-side': { arrangement: 'side-by-side' },
  still: { follow: false },
  'no-forces': { forces: false },
  'no-trail': { trail: false },
  'no-support': { support: false },
  'no-meshes': { meshes: false },
}

/** `side-by-side,no-trail` */
export const VIEW: Codec<SceneOptions> = {
  read: (text) => {
    const words = text.split(',')
    if (!words.every((word) => Object.hasOwn(WORDS, word))) return undefined
    return Object.assign({}, DEFAULT_VIEW, ...words.map((word) => WORDS[word]))
  },
  write: (options) => {
    const isSet = (word: string) =>
      Object.entries(WORDS[word]).every(([key, value]) => options[key as Option] === value)
    return Object.keys(WORDS).filter(isSet).join(',') || null
  },
}

/** A time [s]. */
export const MOMENT: Codec<number | null> = {
  read: (text) =>
    text !== '' && Number(text) >= 0 && Number.isFinite(Number(text)) ? Number(text) : undefined,
  write: (moment) => (moment ? String(Number(moment.toFixed(4))) : null),
}

/** Camera position and target [m], to the mm: `0.81:-1.2:0.64:0:0:0.02`; null for the default. */
export const CAMERA: Codec<CameraPlace | null> = {
  read: (text) => {
    const [x, y, z, u, v, w, ...rest] = numbersOf(text)
    if (rest.length > 0 || ![x, y, z, u, v, w].every(Number.isFinite)) return undefined
    return x === u && y === v && z === w ? undefined : { position: [x, y, z], target: [u, v, w] }
  },
  write: (place) =>
    // Adding zero turns -0 into 0.
    place && [...place.position, ...place.target].map((at) => Number(at.toFixed(3)) + 0).join(':'),
}
