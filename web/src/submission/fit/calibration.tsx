/** New-calibration form: parameters to fit to measured targets. */

import { useMemo, useState } from 'preact/hooks'
import type { Controller, Variable } from '../../api/types'
import { type Option, Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { capitalized, inWords } from '../../format/words'
import type { Catalogue } from '../draft/catalogue'
import { EMPTY_FIT, type FitDraft } from './fit'
import { FitForm } from './fit-form'
import type { FitProps } from './page'
import {
  calibrationSpec,
  nextKey,
  selectedTargets,
  type TargetDraft,
  type TargetWalk,
  walkName,
  withRecordings,
} from './targets'

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
}: FitProps & { recordings: readonly TargetWalk[] }) {
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

function ofWalks(all: readonly Controller[], driving: readonly string[]): readonly Variable[] {
  const variables = new Map<string, Variable>()
  for (const { name, conventions, gait_variables } of all) {
    if (!driving.includes(name)) continue
    for (const variable of [...conventions, ...gait_variables])
      variables.set(variable.name, variable)
  }
  return [...variables.values()]
}

type Change = (targets: readonly TargetDraft[]) => readonly TargetDraft[]

interface TargetsTableProps {
  catalogue: Catalogue
  recordings: readonly TargetWalk[]
  targets: readonly TargetDraft[]
  onChange: (change: Change) => void
}

function TargetsTable({ catalogue, recordings, targets, onChange }: TargetsTableProps) {
  const quantities = catalogue.fields.target.get('quantity')?.choices ?? []
  const add = () =>
    onChange((all) => [
      ...all,
      {
        key: nextKey(all),
        recording: recordings[0].id,
        quantity: 'speed',
        value: '',
        tolerance: '0.1',
        use: 'fit',
      },
    ])
  const set = ({ key }: TargetDraft, changes: Partial<TargetDraft>) =>
    onChange((all) => all.map((old) => (old.key === key ? { ...old, ...changes } : old)))
  const place = (target: TargetDraft) => targets.indexOf(target) + 1
  const select = (name: 'recording' | 'quantity' | 'use', label: string, options: Option[]) => ({
    key: label,
    cell: (target: TargetDraft) => (
      <Select
        hidden
        label={`${capitalized(label)} of target ${place(target)}`}
        value={target[name]}
        options={options}
        onChoose={(value) => set(target, { [name]: value })}
      />
    ),
  })
  const input = (name: 'value' | 'tolerance') => ({
    key: name,
    cell: (target: TargetDraft) => (
      <input
        class="short"
        inputMode="decimal"
        aria-label={`${capitalized(name)} of target ${place(target)}`}
        value={target[name]}
        onInput={(event) => set(target, { [name]: event.currentTarget.value })}
      />
    ),
  })
  const columns: readonly Column<TargetDraft>[] = [
    select(
      'recording',
      'walk',
      recordings.map(({ id, scenario }, k) => [id, `${walkName(k)} (${scenario})`]),
    ),
    select(
      'quantity',
      'quantity',
      quantities.map((name) => [name, inWords(name)]),
    ),
    input('value'),
    input('tolerance'),
    select('use', 'use', [
      ['fit', 'fitted'],
      ['predict', 'predicted'],
    ]),
    {
      key: 'remove',
      cell: (target) => (
        <button
          type="button"
          class="compact"
          aria-label={`Remove target ${place(target)}`}
          onClick={() => onChange((all) => all.filter(({ key }) => key !== target.key))}
        >
          Remove
        </button>
      ),
    },
  ]
  return (
    <section class="stack-tight" aria-labelledby="part-targets">
      <h3 id="part-targets">Targets</h3>
      <p class="muted small">
        A log contains currents only; speed, energy and other quantities are measured separately.
        Tolerances are relative (0.1 is 10&nbsp;%), except for height loss (in metres). Predicted
        targets are reported but not fitted.
      </p>
      <div class="variables">
        <Table<TargetDraft>
          caption="Targets"
          rows={targets}
          rowKey={({ key }) => String(key)}
          rowData={({ quantity }) => ({ 'data-target': quantity })}
          columns={columns}
          pageSize={Number.POSITIVE_INFINITY}
        />
      </div>
      <div class="row">
        <button type="button" class="compact" onClick={add}>
          Add target
        </button>
      </div>
    </section>
  )
}
