/** Validation and estimate of a spec during editing, and its submission. */

import { useRef, useState } from 'preact/hooks'
import { post } from '../api/client'
import { ApiProblem } from '../api/problem'
import { useResource } from '../api/resource'
import type { AnySpec } from '../api/types'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'

const PAUSE_MS = 400

export const NOTIFY = 'Notify-URL'

export type Submission = ReturnType<typeof useSubmission>

/**
 * problem: why the server rejects the spec; null if it does not, or is unknown.
 * missing: what the spec lacks before the server is asked; empty if nothing.
 */
export function useSubmission(spec: AnySpec, missing = '', onSubmitted?: () => void) {
  const [rejected, setRejected] = useState<{ text: string; error: unknown } | null>(null)
  const [sending, setSending] = useState(false)
  const [priority, setPriority] = useState('0')
  const [notify, setNotify] = useState('')
  const text = JSON.stringify(spec)
  const estimate = useResource(
    missing === '' ? text : null,
    (signal) => post('/v1/estimates', { body: spec, signal }),
    { keep: true, pause: PAUSE_MS },
  )
  const problem = rejected?.text === text ? rejected.error : estimate.error

  // The same spec uses the same key, so a repeated request does not create a second job.
  const key = useRef({ text: '', key: '' })
  const submit = () => {
    if (key.current.text !== text) key.current = { text, key: randomKey() }
    const headers = {
      'Idempotency-Key': key.current.key,
      'Job-Priority': priority.trim(),
      ...(notify.trim() !== '' && { [NOTIFY]: notify.trim() }),
    }
    setSending(true)
    post('/v1/jobs', { body: spec, headers })
      .then(
        (job) => {
          onSubmitted?.()
          navigate(jobPath(job.id))
        },
        (error: unknown) => {
          // A response invalidates the key. Without one the job may exist, so a retry must reuse the key.
          if (error instanceof ApiProblem && error.status !== 0) key.current.text = ''
          setRejected({ text, error })
          requestAnimationFrame(showFirstProblem)
        },
      )
      .finally(() => setSending(false))
  }
  return {
    ...{ estimate: problem === null ? estimate.data : null, problem, sending },
    ...{ priority, setPriority, notify, setNotify, submit },
  }
}

function randomKey(): string {
  return [...crypto.getRandomValues(new Uint32Array(4))].map((n) => n.toString(36)).join('')
}

/** Focus the first invalid field, or show the message if there is none. */
function showFirstProblem(): void {
  const field = document.querySelector<HTMLElement>('.submission [aria-invalid="true"]')
  if (field) field.focus()
  else document.querySelector('.submission [role="alert"]')?.scrollIntoView({ block: 'center' })
}
