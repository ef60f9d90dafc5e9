/** A robot of one's own in the making: proposed from its URDF, then looked at. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { post } from '../../api/client'
import type { RobotCheck, RobotDraftRequest } from '../../api/types'
import type { Catalogue } from '../draft/catalogue'
import type { Draft, RobotDraft } from '../draft/draft'
import { robotName, textOf } from './files'
import { withJob, withRobotJob } from './job'

export type ActuatorChoice = NonNullable<RobotDraftRequest['actuator']>

/** Files as they were chosen. */
interface Chosen {
  readonly name: string
  readonly text: string
}

export interface OwnRobot {
  readonly urdf: Chosen | null
  /** One's own; null where it is proposed. */
  readonly toml: Chosen | null
  /** One's own; null where its fields are proposed. */
  readonly job: Chosen | null
  readonly actuator: ActuatorChoice
  /** What the API does now. */
  readonly busy: 'proposing' | 'checking' | null
  readonly problem: { readonly what: string; readonly error: unknown } | null
  /** Of the robot.toml that was proposed. */
  readonly guesses: readonly string[]
  /** What was seen, and of which robot. */
  readonly seen: { readonly robot: RobotDraft; readonly check: RobotCheck } | null
  readonly chooseUrdf: (file: File) => void
  readonly chooseToml: (file: File) => void
  readonly chooseJob: (file: File) => void
  readonly chooseActuator: (actuator: ActuatorChoice) => void
  /** A robot.toml from the URDF, in place of the one that is there. */
  readonly propose: () => void
  readonly check: () => void
}

interface State
  extends Pick<
    OwnRobot,
    'urdf' | 'toml' | 'job' | 'actuator' | 'busy' | 'problem' | 'guesses' | 'seen'
  > {}

const NOTHING: State = {
  urdf: null,
  toml: null,
  job: null,
  actuator: 'auto',
  busy: null,
  problem: null,
  guesses: [],
  seen: null,
}

export function useOwnRobot(
  draft: Draft,
  catalogue: Catalogue,
  onChange: (changes: Partial<Draft>) => void,
): OwnRobot {
  const [state, setState] = useState(NOTHING)
  // Answers come later: what was typed meanwhile beside the robot must stay.
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
  const asked = useRef(new AbortController())
  useEffect(() => () => asked.current.abort(), [])

  /** Do what asks the API, in place of what was asked before. */
  const ask = async (
    busy: State['busy'],
    what: string,
    work: (signal: AbortSignal) => Promise<void>,
  ): Promise<boolean> => {
    asked.current.abort()
    asked.current = new AbortController()
    const { signal } = asked.current
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
    ask('checking', 'This robot cannot be used as it is.', async (signal) => {
      const { robot } = now.current.draft
      const body = { toml: robot.toml, urdf: robot.urdf }
      const found = await post('/v1/robots/checks', { body, signal })
      if (!signal.aborted) set({ seen: { robot, check: found } })
    })

  const propose = async () => {
    const { urdf, actuator } = now.current.state
    if (!urdf) return
    set({ toml: null, guesses: [], seen: null })
    const body = { name: robotName(urdf.name), urdf: urdf.text, actuator }
    const made = await ask('proposing', `No robot can be made of ${urdf.name}.`, async (signal) => {
      const answer = await post('/v1/robots/drafts', { body, signal })
      if (signal.aborted) return
      const { draft: last, state: chosen } = now.current
      const next = chosen.job ? last : withJob(last, catalogue, answer.job)
      const robot = { ...next.robot, toml: answer.toml, urdf: answer.urdf }
      change({ ...next, robot })
      set({ guesses: answer.guesses })
    })
    if (made) await check()
  }

  /** Read a file, and go on with its text. */
  const read = async (file: File, use: (chosen: Chosen) => unknown) => {
    try {
      await use({ name: file.name, text: await textOf(file) })
    } catch (error) {
      set({ problem: { what: `${file.name} was not taken.`, error } })
    }
  }

  return {
    ...state,
    chooseUrdf: (file) =>
      read(file, (urdf) => {
        const own = now.current.state.toml
        set({ urdf, seen: null })
        // Whatever comes of it: the robot is no longer the one before.
        files({ urdf: urdf.text, toml: own?.text ?? '' })
        return own ? check() : propose()
      }),
    chooseToml: (file) =>
      read(file, (toml) => {
        const { urdf } = now.current.state
        set({ toml, guesses: [], seen: null, problem: null })
        files({ toml: toml.text, ...(urdf && { urdf: urdf.text }) })
        return now.current.draft.robot.urdf === '' ? undefined : check()
      }),
    chooseJob: (file) =>
      read(file, (job) => {
        change(withRobotJob(now.current.draft, catalogue, job.text))
        set({ job, problem: null })
      }),
    chooseActuator: (actuator) => {
      set({ actuator })
      if (now.current.state.urdf && !now.current.state.toml) void propose()
    },
    propose: () => void propose(),
    check: () => void check(),
  }
}
