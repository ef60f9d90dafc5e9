/** Name, budget, seed and precision; optimizer and its settings. */

import { inWords } from '../format/words'
import { withPreset } from './draft'
import { ChoiceField, NumberField, Problems } from './number-field'
import type { SectionProps } from './section'

export function JobSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { job } = catalogue.fields
  return (
    <section class="card" aria-labelledby="part-job">
      <h2 id="part-job">Job</h2>
      <div class="fields">
        <div class="field wide">
          <label for="job-name">Name</label>
          <input
            id="job-name"
            value={draft.name}
            maxLength={200}
            placeholder="for people; need not be unique"
            aria-invalid={errors.has('name')}
            onInput={(event) => onChange({ name: event.currentTarget.value })}
          />
          {errors.has('name') && <span class="wrong">{errors.get('name')}</span>}
        </div>
        <NumberField
          label="Iterations"
          field={job.get('iterations')!}
          value={draft.iterations}
          error={errors.get('iterations')}
          onChange={(iterations) => onChange({ iterations })}
        />
        <NumberField
          label="Seed"
          field={job.get('seed')!}
          value={draft.seed}
          error={errors.get('seed')}
          onChange={(seed) => onChange({ seed })}
        />
        <ChoiceField
          label="Precision"
          choices={job.get('precision')!.choices!}
          value={draft.precision}
          error={errors.get('precision')}
          hint="of the search; the best design is judged in double"
          onChange={(precision) => onChange({ precision })}
        />
      </div>
    </section>
  )
}

export function OptimizerSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const change = (name: string, value: string) =>
    onChange({ optimizer: { ...draft.optimizer, [name]: value } })
  return (
    <section class="card" aria-labelledby="part-optimizer">
      <h2 id="part-optimizer">Optimizer</h2>
      <fieldset class="segmented" aria-label="Preset of the optimizer">
        {catalogue.optimizers.map((preset) => {
          const settings = withPreset(draft.optimizer, preset)
          return (
            <button
              key={preset.name}
              type="button"
              aria-pressed={Object.keys(settings).every((k) => settings[k] === draft.optimizer[k])}
              onClick={() => onChange({ optimizer: settings })}
            >
              {preset.name}
            </button>
          )
        })}
      </fieldset>
      <Problems messages={errors.has('optimizer') ? [errors.get('optimizer')!] : []} />
      <div class="fields">
        {[...catalogue.fields.optimizer.values()].map((field) =>
          field.choices ? (
            <ChoiceField
              key={field.name}
              label={inWords(field.name)}
              choices={field.choices}
              value={draft.optimizer[field.name]}
              error={errors.get(`optimizer.${field.name}`)}
              hint={field.description}
              onChange={(value) => change(field.name, value)}
            />
          ) : (
            <NumberField
              key={field.name}
              label={inWords(field.name)}
              field={field}
              value={draft.optimizer[field.name] ?? ''}
              error={errors.get(`optimizer.${field.name}`)}
              onChange={(value) => change(field.name, value)}
            />
          ),
        )}
      </div>
    </section>
  )
}
