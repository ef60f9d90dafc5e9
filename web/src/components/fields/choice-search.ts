/** Paginated search results of a picker. */

import { useState } from 'preact/hooks'
import { useResource } from '../../api/resource'

export interface Choice {
  readonly value: string
  readonly label: string
  readonly note?: string
  /** Why it cannot be chosen. */
  readonly refused?: string
}

export interface ChoicePage {
  readonly items: readonly Choice[]
  readonly next: string | null
}

export type Search = (
  text: string,
  after: string | null,
  signal: AbortSignal,
) => Promise<ChoicePage>

const NOTHING = { items: [], next: null, text: null }

const PAUSE_MS = 150

/** Search while `text` is not null; previous matches stay until the response arrives. */
export function useChoiceSearch(text: string | null, search: Search | undefined) {
  const [before, setBefore] = useState<ChoicePage & { text: string | null }>(NOTHING)
  const { items: earlier, next: after } = before.text === text ? before : NOTHING
  const { data, error } = useResource(
    text === null || !search ? null : JSON.stringify([text, after]),
    async (signal) => {
      const page = await search!(text!, after, signal)
      return { items: [...earlier, ...page.items], next: page.next, text }
    },
    { keep: true, pause: PAUSE_MS },
  )
  const matches = data ?? NOTHING
  const isCurrent = matches.text === text
  return {
    items: matches.items,
    hasMore: matches.next !== null && isCurrent,
    pending: search !== undefined && text !== null && !isCurrent && error === null,
    error,
    more: () => setBefore(matches),
  }
}
