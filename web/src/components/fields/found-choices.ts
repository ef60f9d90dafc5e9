/** What a server finds for a picker, page by page: the next page only when it is asked for. */

import { useEffect, useState } from 'preact/hooks'
import { LatestAnswer } from '../../api/latest-answer'

export interface Choice {
  readonly value: string
  readonly label: string
  readonly note?: string
  /** Why it cannot be chosen. */
  readonly refused?: string
}

export interface FoundPage {
  readonly items: readonly Choice[]
  /** Where the next page begins; null after the last. */
  readonly next: string | null
}

/** The page of what contains the text, from a place on. */
export type Search = (text: string, after: string | null, signal: AbortSignal) => Promise<FoundPage>

interface Asked {
  readonly text: string
  readonly after: string | null
}

interface Found extends FoundPage {
  /** Null before the first answer. */
  readonly text: string | null
  readonly error: unknown
}

const NOTHING: Found = { items: [], next: null, text: null, error: null }

/** So that not every letter is asked for [ms]. */
const PAUSE_MS = 150

/** text: null asks nothing. What was found for another text stays until the answer is there. */
export function useFoundChoices(text: string | null, search: Search | undefined) {
  const [found, setFound] = useState(NOTHING)
  const [latest] = useState(
    () =>
      new LatestAnswer<Asked & { search: Search }, { asked: Asked; page: FoundPage }>(
        async (asked, signal) => ({
          asked,
          page: await asked.search(asked.text, asked.after, signal),
        }),
        ({ asked, page }) =>
          setFound((before) => ({
            items: asked.after === null ? page.items : [...before.items, ...page.items],
            next: page.next,
            text: asked.text,
            error: null,
          })),
        (error) => setFound((before) => ({ ...before, error })),
        PAUSE_MS,
      ),
  )
  useEffect(() => {
    if (text === null || !search) setFound(NOTHING)
    else latest.ask({ text, after: null, search })
    return () => latest.stop()
  }, [text])
  const more = () => {
    if (search && text !== null && found.next) latest.ask({ text, after: found.next, search })
  }
  return {
    items: found.items,
    hasMore: found.next !== null && found.text === text,
    awaited: search !== undefined && text !== null && found.text !== text && found.error === null,
    error: found.error,
    more,
  }
}
