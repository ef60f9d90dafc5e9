/** Editable table of a calibration's targets. */

import type { RecordingView } from '../../api/types'
import { inWords } from '../../format/words'
import type { Catalogue } from '../draft/catalogue'
import { nextKey, type TargetDraft, walkName } from './targets'

type Change = (targets: readonly TargetDraft[]) => readonly TargetDraft[]

export function TargetsTable({
  catalogue,
  recordings,
  targets,
  onChange,
}: {
  catalogue: Catalogue
  recordings: readonly RecordingView[]
  /** Targets of the selected recordings. */
  targets: readonly TargetDraft[]
  onChange: (change: Change) => void
}) {
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
  return (
    <section class="stack-tight" aria-labelledby="part-targets">
      <h3 id="part-targets">Targets</h3>
      <p class="muted small">
        A log contains currents only; speed, energy and other quantities are measured separately.
        Tolerances are relative (0.1 is 10&nbsp;%), except for height loss (in metres). Predicted
        targets are reported but not fitted.
      </p>
      <div class="table-scroll">
        <table class="variables">
          <caption class="visually-hidden">Targets</caption>
          <thead>
            <tr>
              {['Walk', 'Quantity', 'Value', 'Tolerance', 'Use', ''].map((label) => (
                <th key={label} scope="col">
                  {label || <span class="visually-hidden">Remove</span>}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {targets.map((target, index) => (
              <TargetRow
                key={target.key}
                target={target}
                index={index}
                recordings={recordings}
                quantities={quantities}
                onChange={onChange}
              />
            ))}
          </tbody>
        </table>
      </div>
      <div class="row">
        <button type="button" class="compact" onClick={add}>
          Add target
        </button>
      </div>
    </section>
  )
}

function TargetRow({
  target,
  index,
  recordings,
  quantities,
  onChange,
}: {
  target: TargetDraft
  index: number
  recordings: readonly RecordingView[]
  quantities: readonly string[]
  onChange: (change: Change) => void
}) {
  const { key } = target
  const place = index + 1
  const set = (changes: Partial<TargetDraft>) =>
    onChange((all) => all.map((old) => (old.key === key ? { ...old, ...changes } : old)))
  const input = (name: 'value' | 'tolerance') => (
    <input
      class="short"
      inputMode="decimal"
      aria-label={`${name === 'value' ? 'Value' : 'Tolerance'} of target ${place}`}
      value={target[name]}
      onInput={(event) => set({ [name]: event.currentTarget.value })}
    />
  )
  return (
    <tr data-target={target.quantity}>
      <td>
        <select
          aria-label={`Walk of target ${place}`}
          value={target.recording}
          onChange={(event) => set({ recording: event.currentTarget.value })}
        >
          {recordings.map(({ id, scenario }, k) => (
            <option key={id} value={id}>
              {walkName(k)} ({scenario})
            </option>
          ))}
        </select>
      </td>
      <td>
        <select
          aria-label={`Quantity of target ${place}`}
          value={target.quantity}
          onChange={(event) => set({ quantity: event.currentTarget.value })}
        >
          {quantities.map((name) => (
            <option key={name} value={name}>
              {inWords(name)}
            </option>
          ))}
        </select>
      </td>
      <td>{input('value')}</td>
      <td>{input('tolerance')}</td>
      <td>
        <select
          aria-label={`Use of target ${place}`}
          value={target.use}
          onChange={(event) => set({ use: event.currentTarget.value as TargetDraft['use'] })}
        >
          <option value="fit">fitted</option>
          <option value="predict">predicted</option>
        </select>
      </td>
      <td>
        <button
          type="button"
          class="compact"
          aria-label={`Remove target ${place}`}
          onClick={() => onChange((all) => all.filter((old) => old.key !== key))}
        >
          Remove
        </button>
      </td>
    </tr>
  )
}
