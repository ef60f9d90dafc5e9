/** Light or dark: the system's choice unless the user made one, and colours for canvases. */

import { useEffect, useState } from 'preact/hooks'

export type Theme = 'light' | 'dark'

const KEY = 'gaitswarm.theme'
const dark = matchMedia('(prefers-color-scheme: dark)')
const listeners = new Set<() => void>()
const resolved = new Map<string, string>()

/** The theme that is shown now. */
export function currentTheme(): Theme {
  const chosen = document.documentElement.dataset.theme
  if (chosen === 'light' || chosen === 'dark') return chosen
  return dark.matches ? 'dark' : 'light'
}

/** Show the theme chosen on an earlier visit, and follow the system where none was. */
export function startTheme(): void {
  const stored = localStorage.getItem(KEY)
  if (stored === 'light' || stored === 'dark') document.documentElement.dataset.theme = stored
  dark.addEventListener('change', changed)
}

/** Show the other theme, now and on later visits. */
export function toggleTheme(): void {
  const next: Theme = currentTheme() === 'dark' ? 'light' : 'dark'
  document.documentElement.dataset.theme = next
  localStorage.setItem(KEY, next)
  changed()
}

/** The present theme; the component renders again when it changes. */
export function useTheme(): Theme {
  const [theme, setTheme] = useState(currentTheme)
  useEffect(() => {
    const update = () => setTheme(currentTheme())
    listeners.add(update)
    update()
    return () => {
      listeners.delete(update)
    }
  }, [])
  return theme
}

/** A custom property such as `--accent` as `rgb(...)`, for canvases and WebGL. */
export function themeColour(name: `--${string}`): string {
  const known = resolved.get(name)
  if (known !== undefined) return known
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
  for (const listener of [...listeners]) listener()
}
