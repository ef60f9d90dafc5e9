/** Entries of the command palette. */

import { matching } from '../components/table/rows'

export interface Entry {
  readonly key: string
  readonly label: string
  /** Category, shown after the label. */
  readonly kind: string
  readonly run: () => void
}

/** Entries that contain every word; those whose label starts with the text come first. */
export function matchingEntries(entries: readonly Entry[], text: string): readonly Entry[] {
  const begins = (entry: Entry) => entry.label.toLowerCase().startsWith(text.toLowerCase().trim())
  const hits = matching(entries, text, ({ label, kind }) => `${label} ${kind}`)
  return [...hits.filter(begins), ...hits.filter((entry) => !begins(entry))]
}

/** Commands and tabs of the open job, taken from its buttons and links. */
export function entriesOfPage(): readonly Entry[] {
  const offered = (selector: string, kind: string) =>
    [...document.querySelectorAll<HTMLElement>(selector)].map((element, k): Entry => {
      const label = element.textContent?.trim() ?? ''
      return { key: `${kind} ${k}`, label, kind, run: () => element.click() }
    })
  return [
    ...offered('main .actions > .row > :is(button:not(:disabled), a)', 'this job'),
    ...offered('main nav.tabs > a', 'part of this job'),
  ]
}
