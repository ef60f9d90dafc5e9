/** A diverging colour map for colour-blind readers too: blue below zero, orange above. */

import type { Theme } from '../theme'

/** sRGB from -1 to 1, interpolated in Oklab; zero is close to the page's surface colour. */
const STOPS: Readonly<Record<Theme, readonly string[]>> = {
  light:
    '#0e498c #38659e #5d81b1 #819ec2 #a6bad3 #cdd7e4 #f4f5f5 #ebd8d0 #e1bcab #d5a087 #c98463 #bc673d #ad4904'.split(
      ' ',
    ),
  dark: '#78beff #6aa4da #5c8bb5 #4e7292 #405a71 #334451 #262e33 #47413b #695542 #8c6847 #b17c4b #d8914d #ffa64d'.split(
    ' ',
  ),
}

/** Colour of a share from -1 to 1, in sRGB from 0 to 255. */
export function diverging(share: number, theme: Theme): [number, number, number] {
  const stops = STOPS[theme]
  const at = ((Math.min(1, Math.max(-1, share)) + 1) / 2) * (stops.length - 1)
  const from = Math.min(stops.length - 2, Math.floor(at))
  const channel = (i: number) => {
    const [a, b] = [stops[from], stops[from + 1]].map((hex) => Number(`0x${hex.slice(i, i + 2)}`))
    return Math.round(a + (b - a) * (at - from))
  }
  return [channel(1), channel(3), channel(5)]
}

/** The map as a CSS gradient from -1 to 1, left to right. */
export function gradient(theme: Theme): string {
  return `linear-gradient(to right, ${STOPS[theme].join(', ')})`
}
