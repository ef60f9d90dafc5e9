/** Texts of the notification when a job ends. */

import type { StoredJob } from '../../api/types'
import { formatCount, formatNumber } from '../../format/number'

export interface NoticeState {
  /** Label of the button; null if there is none. */
  readonly label: string | null
  readonly on: boolean
  /** Additional information; null for none. */
  readonly hint: string | null
}

export function noticeState(
  permission: NotificationPermission | 'missing',
  enabled: boolean,
): NoticeState {
  if (permission === 'missing') {
    return { label: null, on: false, hint: 'This browser does not support notifications.' }
  }
  if (permission === 'denied') {
    return {
      label: null,
      on: false,
      hint: 'Notifications from this site are blocked in the browser’s settings.',
    }
  }
  if (!enabled) return { label: 'Notify me when it ends', on: false, hint: null }
  return { label: 'Notify me when it ends', on: true, hint: 'while this page is open' }
}

/** Content of the notification. */
export function endInWords(
  job: Pick<StoredJob, 'id' | 'name' | 'state' | 'iterations' | 'best_fitness' | 'error'>,
): { readonly title: string; readonly body: string } {
  const title = `${job.name || job.id}: ${job.state}`
  if (job.state === 'failed') return { title, body: job.error ?? 'No reason given.' }
  const best =
    job.best_fitness === null
      ? 'no design walks in every scenario'
      : `best fitness ${formatNumber(job.best_fitness, 5)}`
  return { title, body: `${formatCount(job.iterations)} iterations, ${best}` }
}
