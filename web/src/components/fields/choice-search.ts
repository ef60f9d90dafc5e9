/** Paginated search results of a picker. */

import { useEffect, useState } from 'preact/hooks'
import { LatestAnswer } from '../../api/latest-answer'

export interface Choice {
  readonly value: string
  readonly label: string
  readonly note?: string
  /** Why it cannot be chosen. */
  readonly refused?: string
}

export interface ChoicePage {
  readonly items: readonly Choice[]
  /** Cursor of the next page; null on the last. */
  readonly next: string | null
}

/** Fetch a page of matches for a text. */
export type Search = (
  text: string,
  after: string | null,
  signal: AbortSignal,
) => Promise<ChoicePage>

interface Query {
  readonly text: string
  readonly after: string | null
}

interface Matches extends ChoicePage {
  /** Null before the first response. */
  readonly text: string | null
  readonly error: unknown
}

const NOTHING: Matches = { items: [], next: null, text: null, error: null }

/** Debounce of typing [ms]. */
const PAUSE_MS = 150

/** Search while `text` is not null; previous matches stay until the response arrives. */
export function useChoiceSearch(text: string | null, search: Search | undefined) {
  const [matches, setMatches] = useState(NOTHING)
  const [latest] = useState(
    () =>
      new LatestAnswer<Query & { search: Search }, { query: Query; page: ChoicePage }>(
        async (query, signal) => ({
          query,
          page: await query.search(query.text, query.after, signal),
        }),
        ({ query, page }) =>
          setMatches((before) => ({
            items: query.after === null ? page.items : [...before.items, ...page.items],
            next: page.next,
            text: query.text,
            error: null,
          })),
        (error) => setMatches((before) => ({ ...before, error })),
        PAUSE_MS,
      ),
  )
  useEffect(() => {
    if (text === null || !search) setMatches(NOTHING)
    else latest.ask({ text, after: null, search })
    return () => latest.stop()
  }, [text])
  const more = () => {
    if (search && text !== null && matches.next) latest.ask({ text, after: matches.next, search })
  }
  return {
    items: matches.items,
    hasMore: matches.next !== null && matches.text === text,
    pending:
      search !== undefined && text !== null && matches.text !== text && matches.error === null,
    error: matches.error,
    more,
  }
}
