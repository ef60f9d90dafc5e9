/** A notice of the browser when a job ends, for those who ask for it. */

import { useEffect, useRef, useState } from 'preact/hooks'
import type { StoredJob } from '../../api/types'
import { hasEnded } from '../state'
import { endInWords, type NoticeState, noticeState } from './end-notice-model'

export function EndNotice({ job }: { job: StoredJob }) {
  const [wanted, setWanted] = useState(false)
  const [permission, setPermission] = useState(permissionNow)
  const before = useRef(job.state)
  const ended = hasEnded(job)
  useEffect(() => {
    const changed = before.current !== job.state
    before.current = job.state
    if (!changed || !ended || !wanted || permission !== 'granted') return
    const { title, body } = endInWords(job)
    const notice = new Notification(title, { body, tag: job.id })
    notice.onclick = () => window.focus()
  }, [job.state, wanted, permission])
  if (ended) return null
  const ask = () => {
    if (wanted) return setWanted(false)
    if (permission !== 'default') return setWanted(permission === 'granted')
    Notification.requestPermission().then((answer) => {
      setPermission(answer)
      setWanted(answer === 'granted')
    })
  }
  return <Asked state={noticeState(permission, wanted)} onAsk={ask} />
}

function Asked({ state, onAsk }: { state: NoticeState; onAsk: () => void }) {
  if (state.hint !== null && state.label === null) {
    return <span class="muted small">{state.hint}</span>
  }
  return (
    <span class="row">
      <button type="button" class="compact" aria-pressed={state.on} onClick={onAsk}>
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
