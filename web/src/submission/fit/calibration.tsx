/** New-calibration form: parameters to fit to measured targets. */

import { useMemo, useState } from 'preact/hooks'
import type { Controller, RecordingView, Variable } from '../../api/types'
import { EMPTY_FIT, type FitDraft } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'
import { calibrationSpec, selectedTargets, type TargetDraft, withRecordings } from './targets'
import { TargetsTable } from './targets-table'

const FITTED_BY_DEFAULT = ['battery_voltage', 'efficiency']

interface Targets {
  /** Recordings whose targets were added; removed targets are not added again. */
  readonly added: readonly string[]
  readonly rows: readonly TargetDraft[]
}

export function CalibrationForm({
  catalogue,
  robot,
  fittable,
  recordings,
}: FitProps & { recordings: readonly RecordingView[] }) {
  const [draft, setDraft] = useState<FitDraft>({
    ...EMPTY_FIT,
    name: 'calibration',
    iterations: '60',
  })
  const [edited, setEdited] = useState<Targets>({ added: [], rows: [] })
  const targets = {
    added: recordings.map(({ id }) => id).concat(edited.added),
    rows: withRecordings(edited.rows, edited.added, recordings),
  }
  const rows = selectedTargets(targets.rows, recordings)
  const controllers = [...new Set(recordings.map(({ controller }) => controller))]
  const parameters = {
    fittable: [
      ...fittable.conventions,
      ...fittable.parameters,
      ...ofWalks(catalogue.controllers, controllers),
    ],
    fittedByDefault: FITTED_BY_DEFAULT,
    edited: draft.edited,
  }
  const spec = useMemo(
    () => calibrationSpec(draft, parameters, rows, robot, recordings, catalogue.optimizers),
    [draft, fittable, JSON.stringify(rows), robot, recordings, catalogue],
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
          onChange={(change) => setEdited({ ...targets, rows: change(targets.rows) })}
        />
      }
    />
  )
}

/** Distinct conventions and gait variables of the controllers of the walks. */
function ofWalks(all: readonly Controller[], driving: readonly string[]): readonly Variable[] {
  const variables = new Map<string, Variable>()
  for (const { name, conventions, gait_variables } of all) {
    if (!driving.includes(name)) continue
    for (const variable of [...conventions, ...gait_variables])
      variables.set(variable.name, variable)
  }
  return [...variables.values()]
}
