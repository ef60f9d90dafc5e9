/** A diverging colour map for colour-blind readers too: blue below zero, orange above. */

import type { Theme } from '../theme'

type Triple = readonly [number, number, number]

/** sRGB, 0 to 255: minimum, zero, maximum; zero is close to the page's surface colour. */
const ENDS: Readonly<Record<Theme, readonly [Triple, Triple, Triple]>> = {
  light: [
    [14, 73, 140],
    [244, 245, 245],
    [173, 73, 4],
  ],
  dark: [
    [120, 190, 255],
    [38, 46, 51],
    [255, 166, 77],
  ],
}

/** Colour of a share from -1 to 1, in sRGB from 0 to 255. */
export function diverging(share: number, theme: Theme): [number, number, number] {
  const [below, zero, above] = ENDS[theme].map(toOklab)
  const clipped = Math.min(1, Math.max(-1, share))
  const end = clipped < 0 ? below : above
  const at = Math.abs(clipped)
  return toSrgb([0, 1, 2].map((k) => zero[k] * (1 - at) + end[k] * at) as unknown as Triple)
}

/** The map as a CSS gradient from -1 to 1, left to right. */
export function gradient(theme: Theme): string {
  const stops = Array.from({ length: 17 }, (_, k) => {
    const [r, g, b] = diverging(k / 8 - 1, theme)
    return `rgb(${r}, ${g}, ${b}) ${(100 * k) / 16}%`
  })
  return `linear-gradient(to right, ${stops.join(', ')})`
}

// Björn Ottosson, "A perceptual color space for image processing" (2020).

function toOklab([r, g, b]: Triple): Triple {
  const [x, y, z] = [r, g, b].map((channel) => linear(channel / 255))
  const l = Math.cbrt(0.4122214708 * x + 0.5363325363 * y + 0.0514459929 * z)
  const m = Math.cbrt(0.2119034982 * x + 0.6806995451 * y + 0.1073969566 * z)
  const s = Math.cbrt(0.0883024619 * x + 0.2817188376 * y + 0.6299787005 * z)
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ]
}

function toSrgb([lightness, a, b]: Triple): [number, number, number] {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3
  return [
    byte(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    byte(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    byte(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ]
}

function linear(channel: number): number {
  return channel <= 0.04045 ? channel / 12.92 : ((channel + 0.055) / 1.055) ** 2.4
}

function byte(channel: number): number {
  const curved = channel <= 0.0031308 ? 12.92 * channel : 1.055 * channel ** (1 / 2.4) - 0.055
  return Math.round(255 * Math.min(1, Math.max(0, curved)))
}
