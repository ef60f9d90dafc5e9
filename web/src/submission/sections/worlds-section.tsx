/** Worlds of a robust job, and the aggregation over them. */

import { Segmented } from '../../components/fields/segmented'
import { formatCount } from '../../format/number'
import { capitalized, inWords, sentence } from '../../format/words'
import { errorsUnder } from '../draft/build-spec'
import { hasEffect, type WorldsDraft, walksEach, worldsFields } from '../draft/worlds'
import { ChoiceField, NumberField, Problems } from '../fields/number-field'
import { describe, type SchemaField } from '../fields/schema-fields'
import type { SectionProps } from './section'

export function WorldsSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { worlds } = draft
  const change = (changes: Partial<WorldsDraft>) => onChange({ worlds: { ...worlds, ...changes } })
  const fields = worldsFields(catalogue.fields.worlds)
  const shown = fields.filter((field) => hasEffect(field, worlds))
  const others = errorsUnder(errors, 'worlds').filter(
    (message) => !worlds.robust || !shown.some(({ name }) => message.startsWith(`${name}: `)),
  )
  return (
    <section class="card" aria-labelledby="part-worlds">
      <h2 id="part-worlds">Robustness</h2>
      <div class="stack">
        <Segmented
          roomy
          label="Evaluated in"
          value={worlds.robust ? 'many' : 'one'}
          options={[
            ['one', 'nominal model'],
            ['many', 'many worlds'],
          ]}
          onChoose={(kind) => change({ robust: kind === 'many' })}
        />
        <p class="muted small">
          A robust job simulates every design in worlds with perturbed friction, masses, battery,
          gears, sensors and ground, and aggregates the results.
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
              {formatCount(worlds.ranges.length)} perturbations with the ranges of the cloned job.
            </span>
            <button type="button" class="compact" onClick={() => change({ ranges: null })}>
              Use all perturbations with default ranges
            </button>
          </p>
        )}
        {worlds.robust && (
          <Cost scenarios={draft.presets.length + draft.custom.length} {...worlds} />
        )}
        <Problems messages={others} />
      </div>
    </section>
  )
}

/** Number of simulations per design. */
function Cost({ scenarios, ...worlds }: WorldsDraft & { scenarios: number }) {
  const each = walksEach(worlds)
  if (!(each > 0)) return null
  return (
    <p class="small" data-walks-each={each * scenarios}>
      Every design is simulated {formatCount(each * scenarios)} times: in {formatCount(scenarios)}{' '}
      scenario{scenarios === 1 ? '' : 's'}, each in {formatCount(each)} world{each === 1 ? '' : 's'}
      .
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
