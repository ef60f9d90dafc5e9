/** The form of a new calibration: which parameters are fitted to what measured walks came to. */

import { useMemo, useState } from 'preact/hooks'
import type { Controller, RecordingView, Variable } from '../../api/types'
import { EMPTY_FIT, type FitDraft } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'
import { calibrationSpec, shown, type TargetDraft, withRecordings } from './targets'
import { TargetsTable } from './targets-table'

/** Parameters that are fitted at first. */
const USUAL = ['battery_voltage', 'efficiency']

interface Targets {
  /** Recordings whose own targets have been put in: what is removed stays so. */
  readonly seen: readonly string[]
  readonly rows: readonly TargetDraft[]
}

export function CalibrationForm({
  catalogue,
  robot,
  known,
  recordings,
}: FitProps & { recordings: readonly RecordingView[] }) {
  const [draft, setDraft] = useState<FitDraft>({
    ...EMPTY_FIT,
    name: 'calibration',
    iterations: '60',
  })
  const [typed, setTyped] = useState<Targets>({ seen: [], rows: [] })
  const targets = {
    seen: recordings.map(({ id }) => id).concat(typed.seen),
    rows: withRecordings(typed.rows, typed.seen, recordings),
  }
  const rows = shown(targets.rows, recordings)
  const controllers = [...new Set(recordings.map(({ controller }) => controller))]
  const parameters = {
    known: [
      ...known.conventions,
      ...known.parameters,
      ...ofWalks(catalogue.controllers, controllers),
    ],
    usual: USUAL,
    said: draft.said,
  }
  const spec = useMemo(
    () => calibrationSpec(draft, parameters, rows, robot, recordings, catalogue.optimizers),
    [draft, known, JSON.stringify(rows), robot, recordings, catalogue],
  )
  return (
    <FitForm
      title="Calibration"
      catalogue={catalogue}
      parameters={parameters}
      draft={draft}
      onDraft={(changes) => setDraft((old) => ({ ...old, ...changes }))}
      spec={spec}
      parts={['robot', 'walks', 'targets', '']}
      before={
        <TargetsTable
          catalogue={catalogue}
          recordings={recordings}
          targets={rows}
          onChange={(change) => setTyped({ ...targets, rows: change(targets.rows) })}
        />
      }
    />
  )
}

/** Conventions of the controllers that drive the walks, and what their gaits may be; each once. */
function ofWalks(all: readonly Controller[], driving: readonly string[]): readonly Variable[] {
  const found = new Map<string, Variable>()
  for (const { name, conventions, gait_variables } of all) {
    if (!driving.includes(name)) continue
    for (const variable of [...conventions, ...gait_variables]) found.set(variable.name, variable)
  }
  return [...found.values()]
}
