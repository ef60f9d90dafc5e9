/** Robust jobs: worlds that differ from the model, and what the walks in them come to. */

import { Segmented } from '../../components/fields/segmented'
import { formatCount } from '../../format/number'
import { capitalized, inWords, sentence } from '../../format/words'
import { errorsUnder } from '../draft/build-spec'
import { counts, type WorldsDraft, walksEach, worldsFields } from '../draft/worlds'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import { describe, type SchemaField } from '../fields/schema-fields'
import type { SectionProps } from './section'

export function WorldsSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { worlds } = draft
  const change = (changes: Partial<WorldsDraft>) => onChange({ worlds: { ...worlds, ...changes } })
  const fields = worldsFields(catalogue.fields.worlds)
  const shown = fields.filter((field) => counts(field, worlds))
  const others = errorsUnder(errors, 'worlds').filter(
    (message) => !worlds.robust || !shown.some(({ name }) => message.startsWith(`${name}: `)),
  )
  return (
    <section class="card" aria-labelledby="part-worlds">
      <h2 id="part-worlds">Robustness</h2>
      <div class="stack">
        <Segmented
          roomy
          label="Judged in"
          value={worlds.robust ? 'many' : 'one'}
          options={[
            ['one', 'the model alone'],
            ['many', 'many worlds'],
          ]}
          onChoose={(kind) => change({ robust: kind === 'many' })}
        />
        <p class="muted small">
          A robust job lets every design walk in worlds that differ from the model in friction,
          masses, battery, gears, sensors and ground, and judges it by all of them.
        </p>
        {worlds.robust && (
          <div class="fields">
            {shown.map((field) => (
              <WorldsField
                key={field.name}
                field={field}
                value={worlds.values[field.name]}
                error={errors.get(`worlds.${field.name}`)}
                onChange={(value) => change({ values: { ...worlds.values, [field.name]: value } })}
              />
            ))}
          </div>
        )}
        {worlds.robust && worlds.ranges && (
          <p class="row">
            <span>
              {formatCount(worlds.ranges.length)} perturbations are drawn, within the ranges of the
              cloned job.
            </span>
            <button type="button" class="compact" onClick={() => change({ ranges: null })}>
              Draw all, within the usual ones
            </button>
          </p>
        )}
        {worlds.robust && <Cost scenarios={draft.presets.length + draft.own.length} {...worlds} />}
        <Problems messages={others} />
      </div>
    </section>
  )
}

/** What robustness costs; the estimate has it in full. */
function Cost({ scenarios, ...worlds }: WorldsDraft & { scenarios: number }) {
  const each = walksEach(worlds)
  if (!(each > 0)) return null
  return (
    <p class="small" data-walks-each={each * scenarios}>
      Every design walks {formatCount(each * scenarios)} times: in {formatCount(scenarios)} scenario
      {scenarios === 1 ? '' : 's'}, each in {formatCount(each)} world
      {each === 1 ? '' : 's'}.
    </p>
  )
}

function WorldsField({
  field,
  value,
  error,
  onChange,
}: {
  field: SchemaField
  value: string
  error?: string
  onChange: (value: string) => void
}) {
  const label = field.name === 'count' ? 'Worlds' : capitalized(inWords(field.name))
  const shared = { label, value, error, onChange }
  return field.choices ? (
    <ChoiceField {...shared} choices={field.choices} hint={sentence(describe(field))} />
  ) : (
    <NumberField {...shared} field={field} help={sentence(describe(field))} />
  )
}
