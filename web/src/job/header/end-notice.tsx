/** Opt-in browser notification when a job ends. */

import { useEffect, useRef, useState } from 'preact/hooks'
import type { StoredJob } from '../../api/types'
import { hasEnded } from '../state'
import { endInWords, type NoticeState, noticeState } from './end-notice-model'

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
  return <NoticeToggle state={noticeState(permission, enabled)} onToggle={toggle} />
}

function NoticeToggle({ state, onToggle }: { state: NoticeState; onToggle: () => void }) {
  if (state.hint !== null && state.label === null) {
    return <span class="muted small">{state.hint}</span>
  }
  return (
    <span class="row">
      <button type="button" class="compact" aria-pressed={state.on} onClick={onToggle}>
        {state.label}
      </button>
      {state.hint !== null && (
        <span class="muted small" role="status">
          {state.hint}
        </span>
      )}
    </span>
  )
}

function permissionNow(): NotificationPermission | 'missing' {
  return 'Notification' in globalThis ? Notification.permission : 'missing'
}
