/** Keys that work everywhere: which there are, and when they are heard. */

/** What a key does. */
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
  { key: '?', words: 'These keys', action: { kind: 'help' } },
]

/** What has a use of its own for letters. */
const OWN_LETTERS =
  'input, select, textarea, [contenteditable], dialog, [role="menu"], [role="application"]'

const KEY = 'gaitswarm.shortcuts'

/** Whether keys without Ctrl do something; whoever speaks to the machine may not want it. */
export function shortcutsOn(): boolean {
  return localStorage.getItem(KEY) !== 'off'
}

export function switchShortcuts(on: boolean): void {
  if (on) localStorage.removeItem(KEY)
  else localStorage.setItem(KEY, 'off')
}

/** What a key asks for; null for nothing. on: whether keys without Ctrl do something. */
export function actionOf(
  event: Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey' | 'isComposing'>,
  target: Pick<Element, 'closest'> | null,
  on: boolean,
): Action | null {
  if (event.isComposing || event.altKey) return null
  if (event.ctrlKey || event.metaKey) {
    return event.key.toLowerCase() === 'k' ? { kind: 'palette' } : null
  }
  if (!on || target?.closest(OWN_LETTERS)) return null
  return SHORTCUTS.find(({ key }) => key === event.key)?.action ?? null
}
