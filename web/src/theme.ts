/** Light and dark theme, and theme colours for canvases. */

import { Changes, useFollowed } from './changes'

export type Theme = 'light' | 'dark'

const KEY = 'gaitswarm.theme'
const DARK = '(prefers-color-scheme: dark)'
const changes = new Changes()
const resolved = new Map<string, string>()

export function currentTheme(): Theme {
  const chosen = document.documentElement.dataset.theme
  if (chosen === 'light' || chosen === 'dark') return chosen
  return matchMedia(DARK).matches ? 'dark' : 'light'
}

/** Apply the stored theme, and follow the system's otherwise. */
export function startTheme(): void {
  const stored = localStorage.getItem(KEY)
  if (stored === 'light' || stored === 'dark') document.documentElement.dataset.theme = stored
  matchMedia(DARK).addEventListener('change', changed)
}

/** Switch the theme, now and on later visits. */
export function toggleTheme(): void {
  const next: Theme = currentTheme() === 'dark' ? 'light' : 'dark'
  document.documentElement.dataset.theme = next
  localStorage.setItem(KEY, next)
  changed()
}

export function useTheme(): Theme {
  return useFollowed(changes, currentTheme)
}

/** Resolve a custom property such as `--accent` to `rgb(...)`, for canvases and WebGL. */
export function themeColour(name: `--${string}`): string {
  const cached = resolved.get(name)
  if (cached !== undefined) return cached
  // A custom property's own computed value is unresolved; that of `color` is not.
  const probe = document.createElement('span')
  probe.style.color = `var(${name})`
  document.body.append(probe)
  const colour = getComputedStyle(probe).color
  probe.remove()
  resolved.set(name, colour)
  return colour
}

function changed(): void {
  resolved.clear()
  changes.notify()
}
