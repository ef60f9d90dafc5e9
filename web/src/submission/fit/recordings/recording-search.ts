/** Server-side search for recordings by scenario, controller or id. */

import { get } from '../../../api/client'
import type { RecordingEntry } from '../../../api/types'
import type { Choice, Search } from '../../../components/fields/choice-search'
import { formatNumber } from '../../../format/number'
import { formatMoment } from '../../../format/time'

const PAGE = 20

const ID = /^[0-9a-f]{32}$/

export function shortId(id: string): string {
  return id.slice(0, 12)
}

/** Distinct ids in a text; none if it contains anything else. */
export function idsIn(text: string): string[] {
  const words = text.split(/[\s,;"'[\]]+/).filter((word) => word !== '')
  return words.every((word) => ID.test(word)) ? [...new Set(words)] : []
}

/** exclude: ids of recordings that are not offered. */
export function recordingSearch(exclude: readonly string[]): Search {
  return async (search, after, signal) => {
    const page = await get('/v1/recordings', { query: { search, after, limit: PAGE }, signal })
    const items = page.items.filter(({ id }) => !exclude.includes(id)).map(choiceOf)
    return { items, next: page.next ?? null }
  }
}

export function choiceOf(recording: RecordingEntry): Choice {
  const { id, seconds, scenario, controller, joints, size } = recording
  const parts = [
    `${shortId(id)} · ${formatMoment(recording.created_at)}`,
    `${joints} joints`,
    `${formatNumber(size / 1000, 3)} kB`,
    recording.synthetic ? 'synthetic' : '',
  ]
  return {
    value: id,
    label: `${formatNumber(seconds, 3)} s of ${scenario} with ${controller}`,
    note: parts.filter((part) => part !== '').join(' · '),
  }
}
