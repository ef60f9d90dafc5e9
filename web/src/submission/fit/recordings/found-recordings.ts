/** Recorded walks to choose from, as the server finds them: by scenario, controller or id. */

import { get } from '../../../api/client'
import type { RecordingEntry } from '../../../api/types'
import type { Choice, Search } from '../../../components/fields/found-choices'
import { formatNumber } from '../../../format/number'
import { formatMoment } from '../../../format/time'

/** Recordings of one page of the picker. */
const PAGE = 20

/** Of a recording, in full. */
const ID = /^[0-9a-f]{32}$/

/** As much of an id as is shown. */
export function shortId(id: string): string {
  return id.slice(0, 12)
}

/** The ids that a text consists of, each once; none if there is anything else in it. */
export function idsIn(text: string): string[] {
  const words = text.split(/[\s,;"'[\]]+/).filter((word) => word !== '')
  return words.every((word) => ID.test(word)) ? [...new Set(words)] : []
}

/** without: ids of recordings that are not offered. */
export function foundRecordings(without: readonly string[]): Search {
  return async (search, after, signal) => {
    const page = await get('/v1/recordings', { query: { search, after, limit: PAGE }, signal })
    const items = page.items.filter(({ id }) => !without.includes(id)).map(choiceOf)
    return { items, next: page.next ?? null }
  }
}

export function choiceOf(recording: RecordingEntry): Choice {
  const { id, seconds, scenario, controller, joints, rate, size } = recording
  const kept = `${shortId(id)} · ${formatMoment(recording.created_at)}`
  if (scenario === null || seconds === null) {
    return { value: id, label: shortId(id), refused: `${kept} · cannot be read` }
  }
  const parts = [
    kept,
    `${joints} joints`,
    `${formatNumber(rate, 3)} rows a second`,
    `${formatNumber(size / 1000, 3)} kB`,
    recording.synthetic ? 'synthetic' : '',
  ]
  return {
    value: id,
    label: `${formatNumber(seconds, 3)} s of ${scenario} with ${controller}`,
    note: parts.filter((part) => part !== '').join(' · '),
  }
}
