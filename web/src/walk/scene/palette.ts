/** Colours of the scene, derived from the page's. */

import { Color } from 'three'
import { currentTheme, themeColour } from '../../theme'

export interface Palette {
  readonly background: Color
  readonly ground: Color
  readonly cell: Color
  readonly metre: Color
  readonly text: string
  readonly force: Color
  readonly load: Color
  readonly shadow: number
  readonly walks: readonly FigurePalette[]
}

/** Colours of one robot. accent: identifies the walk, as in the charts. */
export interface FigurePalette {
  readonly accent: Color
  readonly frame: Color
  readonly limb: Color
  readonly joint: Color
}

export function palette(): Palette {
  const dark = currentTheme() === 'dark'
  const neutral = {
    frame: new Color(dark ? '#7d8f99' : '#6a7983'),
    limb: new Color(dark ? '#c9d4da' : '#b9c4ca'),
    joint: new Color(dark ? '#39464d' : '#2b353a'),
  }
  return {
    background: colour('--surface-sunken'),
    ground: new Color(dark ? '#1a2226' : '#f7f9fa'),
    cell: new Color(dark ? '#2c373d' : '#dde4e8'),
    metre: new Color(dark ? '#4a5a63' : '#b4c0c7'),
    text: themeColour('--text-muted'),
    force: colour('--series-5'),
    load: colour('--warn'),
    shadow: dark ? 0.45 : 0.22,
    walks: [
      { ...neutral, accent: colour('--series-1') },
      { ...neutral, accent: colour('--series-2') },
    ],
  }
}

function colour(name: `--${string}`): Color {
  // three parses only rgb(1, 2, 3), but browsers may write color(srgb ...) or rgb(1 2 3).
  const [r, g, b] = (themeColour(name).match(/[\d.]+/g) ?? ['128', '128', '128']).map(Number)
  return new Color(`rgb(${Math.round(r)}, ${Math.round(g)}, ${Math.round(b)})`)
}
