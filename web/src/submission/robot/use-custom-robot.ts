/** State of a custom robot: its files, proposal and check. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { post } from '../../api/client'
import type { RobotCheck, RobotDraftRequest } from '../../api/types'
import type { Catalogue } from '../draft/catalogue'
import type { Draft, RobotDraft } from '../draft/draft'
import { type Hints, hintsOf, robotName, takeHanded, textOf, withJob, withRobotJob } from './job'

export type ActuatorChoice = NonNullable<RobotDraftRequest['actuator']>

interface TextFile {
  readonly name: string
  readonly text: string
}

interface State {
  readonly urdf: TextFile | null
  readonly toml: TextFile | null
  readonly job: TextFile | null
  readonly actuator: ActuatorChoice
  readonly hints: Hints
  readonly busy: 'proposing' | 'checking' | null
  readonly problem: { readonly what: string; readonly error: unknown } | null
  readonly guesses: readonly string[]
  /** Check result, and the robot that was checked. */
  readonly checked: { readonly robot: RobotDraft; readonly check: RobotCheck } | null
}

const NOTHING: State = {
  urdf: null,
  toml: null,
  job: null,
  actuator: 'auto',
  hints: { locks: '', feet: '', mass: '', actuators: '' },
  busy: null,
  problem: null,
  guesses: [],
  checked: null,
}

export function useCustomRobot(
  draft: Draft,
  catalogue: Catalogue,
  onChange: (changes: Partial<Draft>) => void,
) {
  const [state, setState] = useState(NOTHING)
  // Responses are asynchronous; edits made meanwhile must be kept.
  const now = useRef({ draft, state })
  now.current = { draft, state }
  const set = (changes: Partial<State>) => {
    now.current = { ...now.current, state: { ...now.current.state, ...changes } }
    setState(now.current.state)
  }
  const change = (changes: Partial<Draft>) => {
    now.current = { ...now.current, draft: { ...now.current.draft, ...changes } }
    onChange(changes)
  }
  const files = (changes: Partial<RobotDraft>) =>
    change({ robot: { ...now.current.draft.robot, ...changes } })
  const abortController = useRef(new AbortController())
  useEffect(() => {
    const file = takeHanded()
    if (file) void chooseUrdf(file)
    return () => abortController.current.abort()
  }, [])

  /** Run a request, aborting the previous one. */
  const request = async (
    busy: State['busy'],
    what: string,
    work: (signal: AbortSignal) => Promise<void>,
  ): Promise<boolean> => {
    abortController.current.abort()
    abortController.current = new AbortController()
    const { signal } = abortController.current
    set({ busy, problem: null })
    try {
      await work(signal)
      return !signal.aborted
    } catch (error) {
      if (!signal.aborted) set({ problem: { what, error } })
      return false
    } finally {
      if (!signal.aborted) set({ busy: null })
    }
  }

  const check = () =>
    request('checking', 'This robot cannot be used as it is.', async (signal) => {
      const { robot } = now.current.draft
      const body = { toml: robot.toml, urdf: robot.urdf }
      const checkResult = await post('/v1/robots/checks', { body, signal })
      if (!signal.aborted) set({ checked: { robot, check: checkResult } })
    })

  const propose = async () => {
    const { urdf, actuator, hints } = now.current.state
    if (!urdf) return
    set({ toml: null, guesses: [], checked: null })
    const body = { name: robotName(urdf.name), urdf: urdf.text, actuator, ...hintsOf(hints) }
    const succeeded = await request(
      'proposing',
      `Could not create a robot from ${urdf.name}.`,
      async (signal) => {
        const answer = await post('/v1/robots/drafts', { body, signal })
        if (signal.aborted) return
        const { draft: last, state: latest } = now.current
        const next = latest.job ? last : withJob(last, catalogue, answer.job)
        const robot = { ...next.robot, toml: answer.toml, urdf: answer.urdf }
        change({ ...next, robot })
        set({ guesses: answer.guesses })
      },
    )
    if (succeeded) await check()
  }

  const read = async (file: File, use: (file: TextFile) => unknown) => {
    try {
      await use({ name: file.name, text: await textOf(file) })
    } catch (error) {
      set({ problem: { what: `Could not use ${file.name}.`, error } })
    }
  }

  const chooseUrdf = (file: File) =>
    read(file, (urdf) => {
      const uploadedToml = now.current.state.toml
      set({ urdf, checked: null })
      // The previous robot no longer applies, whatever the outcome.
      files({ urdf: urdf.text, toml: uploadedToml?.text ?? '' })
      return uploadedToml ? check() : propose()
    })

  return {
    ...state,
    chooseUrdf,
    chooseToml: (file: File) =>
      read(file, (toml) => {
        const { urdf } = now.current.state
        set({ toml, guesses: [], checked: null, problem: null })
        files({ toml: toml.text, ...(urdf && { urdf: urdf.text }) })
        return now.current.draft.robot.urdf === '' ? undefined : check()
      }),
    chooseJob: (file: File) =>
      read(file, (job) => {
        change(withRobotJob(now.current.draft, catalogue, job.text))
        set({ job, problem: null })
      }),
    chooseActuator: (actuator: ActuatorChoice) => {
      set({ actuator })
      if (now.current.state.urdf && !now.current.state.toml) void propose()
    },
    setHints: (changes: Partial<Hints>) =>
      set({ hints: { ...now.current.state.hints, ...changes } }),
    /** Generate robot.toml from the URDF, replacing the current one. */
    propose: () => void propose(),
    check: () => void check(),
  }
}
