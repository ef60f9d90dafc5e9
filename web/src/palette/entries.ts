/** What the palette offers: pages, what can be done with the job that is open, and jobs. Pure but for the page. */

import { matching } from '../components/table/rows'

export interface Entry {
  readonly key: string
  readonly label: string
  /** What kind of thing it is. */
  readonly kind: string
  readonly run: () => void
}

/** Entries in which every word occurs, those whose label begins with the text first. */
export function found(entries: readonly Entry[], text: string): readonly Entry[] {
  const begins = (entry: Entry) => entry.label.toLowerCase().startsWith(text.toLowerCase().trim())
  const hits = matching(entries, text, ({ label, kind }) => `${label} ${kind}`)
  return [...hits.filter(begins), ...hits.filter((entry) => !begins(entry))]
}

/** The commands and parts of the job that is shown: those that its own buttons and links offer now. */
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
