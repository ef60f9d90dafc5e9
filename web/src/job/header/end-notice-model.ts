/** What is said of a notice of the browser. Pure. */

import type { StoredJob } from '../../api/types'
import { formatCount, formatNumber } from '../../format/number'

export interface NoticeState {
  /** Of the button; null where there is nothing to press. */
  readonly label: string | null
  readonly on: boolean
  /** What there is to know; null for nothing. */
  readonly hint: string | null
}

export function noticeState(
  permission: NotificationPermission | 'missing',
  wanted: boolean,
): NoticeState {
  if (permission === 'missing') {
    return { label: null, on: false, hint: 'This browser has no notices.' }
  }
  if (permission === 'denied') {
    return {
      label: null,
      on: false,
      hint: 'This browser refuses notices of this page; its settings allow them.',
    }
  }
  if (!wanted) return { label: 'Tell me when it ends', on: false, hint: null }
  return { label: 'Tell me when it ends', on: true, hint: 'as long as this page is open' }
}

/** The notice itself. */
export function endInWords(
  job: Pick<StoredJob, 'id' | 'name' | 'state' | 'iterations' | 'best_fitness' | 'error'>,
): { readonly title: string; readonly body: string } {
  const title = `${job.name || job.id}: ${job.state}`
  if (job.state === 'failed') return { title, body: job.error ?? 'It says no reason.' }
  const best =
    job.best_fitness === null
      ? 'no design walks in every scenario'
      : `best fitness ${formatNumber(job.best_fitness, 5)}`
  return { title, body: `${formatCount(job.iterations)} iterations, ${best}` }
}
