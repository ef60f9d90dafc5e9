/** The form of a new calibration: which parameters are fitted to what measured walks came to. */

import { useMemo, useState } from 'preact/hooks'
import type { RecordingView } from '../../api/types'
import { EMPTY_FIT, type FitDraft } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'
import { calibrationSpec, shown, type TargetDraft, withRecordings } from './targets'
import { TargetsTable } from './targets-table'

interface Targets {
  /** Recordings whose own targets have been put in: what is removed stays so. */
  readonly seen: readonly string[]
  readonly rows: readonly TargetDraft[]
}

export function CalibrationForm({
  catalogue,
  robot,
  onRobot,
  recordings,
}: FitProps & { recordings: readonly RecordingView[] }) {
  const [draft, setDraft] = useState<FitDraft>({
    ...EMPTY_FIT,
    name: 'calibration',
    variables: 'battery_voltage, efficiency',
    iterations: '60',
  })
  const [typed, setTyped] = useState<Targets>({ seen: [], rows: [] })
  const targets = {
    seen: recordings.map(({ id }) => id).concat(typed.seen),
    rows: withRecordings(typed.rows, typed.seen, recordings),
  }
  const rows = shown(targets.rows, recordings)
  const spec = useMemo(
    () => calibrationSpec(draft, rows, robot, recordings, catalogue.optimizers),
    [draft, JSON.stringify(rows), robot, recordings, catalogue],
  )
  return (
    <FitForm
      title="Calibration"
      catalogue={catalogue}
      robot={robot}
      onRobot={onRobot}
      draft={draft}
      onDraft={(changes) => setDraft((old) => ({ ...old, ...changes }))}
      spec={spec}
      parts={['walks', 'targets', '']}
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
