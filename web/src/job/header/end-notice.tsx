/** Opt-in browser notification when a job ends. */

import { useEffect, useRef, useState } from 'preact/hooks'
import type { StoredJob } from '../../api/types'
import { formatCount, formatNumber } from '../../format/number'
import { hasEnded } from '../facts'

export function EndNotice({ job }: { job: StoredJob }) {
  const [enabled, setEnabled] = useState(false)
  const [permission, setPermission] = useState(permissionNow)
  const before = useRef(job.state)
  const ended = hasEnded(job)
  useEffect(() => {
    const changed = before.current !== job.state
    before.current = job.state
    if (!changed || !ended || !enabled || permission !== 'granted') return
    const { title, body } = endInWords(job)
    const notice = new Notification(title, { body, tag: job.id })
    notice.onclick = () => window.focus()
  }, [job.state, enabled, permission])
  if (ended) return null
  const toggle = () => {
    if (enabled) return setEnabled(false)
    if (permission !== 'default') return setEnabled(permission === 'granted')
    Notification.requestPermission().then((answer) => {
      setPermission(answer)
      setEnabled(answer === 'granted')
    })
  }
  const { label, on, hint } = noticeState(permission, enabled)
  if (label === null) return <span class="muted small">{hint}</span>
  return (
    <span class="row">
      <button type="button" class="compact" aria-pressed={on} onClick={toggle}>
        {label}
      </button>
      {hint !== null && (
        <span class="muted small" role="status">
          {hint}
        </span>
      )}
    </span>
  )
}

function permissionNow(): NotificationPermission | 'missing' {
  return 'Notification' in globalThis ? Notification.permission : 'missing'
}

/** Label of the button and additional information; null for none. on: whether the button is pressed. */
export function noticeState(permission: NotificationPermission | 'missing', on: boolean) {
  const unavailable = {
    missing: 'This browser does not support notifications.',
    denied: 'Notifications from this site are blocked in the browser’s settings.',
  }
  if (permission === 'missing' || permission === 'denied') {
    return { label: null, on: false, hint: unavailable[permission] }
  }
  return { label: 'Notify me when it ends', on, hint: on ? 'while this page is open' : null }
}

export function endInWords(
  job: Pick<StoredJob, 'id' | 'name' | 'state' | 'evaluations' | 'best_fitness' | 'error'>,
): { readonly title: string; readonly body: string } {
  const title = `${job.name || job.id}: ${job.state}`
  if (job.state === 'failed') return { title, body: job.error ?? 'No reason given.' }
  const best =
    job.best_fitness === null
      ? 'no design walks in every scenario'
      : `best fitness ${formatNumber(job.best_fitness, 5)}`
  return { title, body: `${formatCount(job.evaluations)} evaluations, ${best}` }
}
