/** Editable table of a calibration's targets. */

import type { RecordingView } from '../../api/types'
import { type Option, Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { capitalized, inWords } from '../../format/words'
import type { Catalogue } from '../draft/catalogue'
import { nextKey, type TargetDraft, walkName } from './targets'

type Change = (targets: readonly TargetDraft[]) => readonly TargetDraft[]

interface TargetsTableProps {
  catalogue: Catalogue
  recordings: readonly RecordingView[]
  targets: readonly TargetDraft[]
  onChange: (change: Change) => void
}

export function TargetsTable({ catalogue, recordings, targets, onChange }: TargetsTableProps) {
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
