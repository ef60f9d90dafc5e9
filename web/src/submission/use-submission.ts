/** Validation and estimate of a spec during editing, and its submission. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { post } from '../api/client'
import { LatestAnswer } from '../api/latest-answer'
import { ApiProblem } from '../api/problem'
import type { AnySpec, Estimate } from '../api/types'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'

/** Debounce of typing [ms]. */
const PAUSE_MS = 400

/** Request header with the webhook's URL. */
export const NOTIFY = 'Notify-URL'

export interface Submission {
  readonly estimate: Estimate | null
  /** Why the server rejects the spec; null if it does not, or is unknown. */
  readonly problem: unknown
  readonly sending: boolean
  /** Number of rejected submissions. */
  readonly attempts: number
  /** Priority as typed. */
  readonly priority: string
  readonly setPriority: (text: string) => void
  /** Webhook URL as typed; empty for none. */
  readonly notify: string
  readonly setNotify: (text: string) => void
  readonly submit: () => void
}

export function useSubmission(spec: AnySpec): Submission {
  const [estimate, setEstimate] = useState<Estimate | null>(null)
  const [problem, setProblem] = useState<unknown>(null)
  const [sending, setSending] = useState(false)
  const [attempts, setAttempts] = useState(0)
  const [priority, setPriority] = useState('0')
  const [notify, setNotify] = useState('')
  const [latest] = useState(
    () =>
      new LatestAnswer(
        (body: AnySpec, signal) => post('/v1/estimates', { body, signal }),
        (answer) => {
          setEstimate(answer)
          setProblem(null)
        },
        (error) => {
          setEstimate(null)
          setProblem(error)
        },
        PAUSE_MS,
      ),
  )
  const text = JSON.stringify(spec)
  useEffect(() => latest.ask(spec), [text])
  useEffect(() => () => latest.stop(), [])

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
        (job) => navigate(jobPath(job.id)),
        (error: unknown) => {
          // A response invalidates the key. Without one the job may exist, so a retry must reuse the key.
          if (error instanceof ApiProblem && error.status !== 0) key.current.text = ''
          setProblem(error)
          setAttempts((n) => n + 1)
        },
      )
      .finally(() => setSending(false))
  }
  return {
    ...{ estimate, problem, sending, attempts },
    ...{ priority, setPriority, notify, setNotify, submit },
  }
}

function randomKey(): string {
  return [...crypto.getRandomValues(new Uint32Array(4))].map((n) => n.toString(36)).join('')
}
