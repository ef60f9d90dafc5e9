/** What the API thinks of a spec while it is written, and its submission. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { post } from '../api/client'
import { LatestAnswer } from '../api/latest-answer'
import { ApiProblem } from '../api/problem'
import type { AnySpec, Estimate } from '../api/types'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'

/** Pause in typing after which the API is asked [ms]. */
const PAUSE_MS = 400

/** Header that names the URL. */
export const NOTIFY = 'Notify-URL'

export interface Submission {
  readonly estimate: Estimate | null
  /** What the API has against the spec as it stands; null if nothing is known. */
  readonly problem: unknown
  readonly sending: boolean
  /** Submissions that were refused so far. */
  readonly attempts: number
  /** How urgent the job is to be, as it was typed. */
  readonly priority: string
  readonly setPriority: (text: string) => void
  /** URL that is told of the job's end, as it was typed; empty for none. */
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

  // The same spec has the same key: a repeated request does not make a second job.
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
          // An answer ends the use of the key; without one, asking again must not double the job.
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
