/** Global keyboard shortcuts, and entries of the command palette. */

import { matching } from '../components/table/rows'

export type Action =
  | { readonly kind: 'go'; readonly href: string }
  | { readonly kind: 'palette' | 'help' | 'theme' }

export const SHORTCUTS: readonly {
  readonly key: string
  readonly words: string
  readonly action: Action
}[] = [
  { key: 'j', words: 'All jobs', action: { kind: 'go', href: '/jobs' } },
  { key: 'n', words: 'New job', action: { kind: 'go', href: '/jobs/new' } },
  { key: 'w', words: 'Walk', action: { kind: 'go', href: '/walk' } },
  { key: 'c', words: 'Controller', action: { kind: 'go', href: '/controller' } },
  { key: 't', words: 'Light or dark', action: { kind: 'theme' } },
  { key: '/', words: 'Find pages, jobs and commands', action: { kind: 'palette' } },
  { key: '?', words: 'Keyboard shortcuts', action: { kind: 'help' } },
]

/** Elements that handle letters themselves. */
const LETTER_TARGETS =
  'input, select, textarea, [contenteditable], dialog, [role="menu"], [role="application"]'

const KEY = 'gaitswarm.shortcuts'

/** Whether single-key shortcuts are enabled; speech input may trigger them by accident. */
export function shortcutsOn(): boolean {
  return localStorage.getItem(KEY) !== 'off'
}

export function switchShortcuts(on: boolean): void {
  if (on) localStorage.removeItem(KEY)
  else localStorage.setItem(KEY, 'off')
}

/** Action of a key; null for none. on: whether single-key shortcuts are enabled. */
export function actionOf(
  event: Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey' | 'isComposing'>,
  target: Pick<Element, 'closest'> | null,
  on: boolean,
): Action | null {
  if (event.isComposing || event.altKey) return null
  if (event.ctrlKey || event.metaKey) {
    return event.key.toLowerCase() === 'k' ? { kind: 'palette' } : null
  }
  if (!on || target?.closest(LETTER_TARGETS)) return null
  return SHORTCUTS.find(({ key }) => key === event.key)?.action ?? null
}

export interface Entry {
  readonly key: string
  readonly label: string
  readonly kind: string
  readonly run: () => void
}

/** Entries that contain every word; those whose label starts with the text come first. */
export function matchingEntries(entries: readonly Entry[], text: string): readonly Entry[] {
  const begins = (entry: Entry) => entry.label.toLowerCase().startsWith(text.toLowerCase().trim())
  const hits = matching(entries, text, ({ label, kind }) => `${label} ${kind}`)
  return [...hits.filter(begins), ...hits.filter((entry) => !begins(entry))]
}
