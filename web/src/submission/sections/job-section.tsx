/** Name, budget, seed and precision. */

import { ChoiceField, NumberField } from '../fields/number-field'
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
            placeholder="optional; need not be unique"
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
          hint="of the search; the best design is evaluated in double precision"
          onChange={(precision) => onChange({ precision })}
        />
      </div>
    </section>
  )
}
