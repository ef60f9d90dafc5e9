/** How a design is judged over its scenarios: by their weighted mean, or by the worst. */

import type { JobSpec } from '../../api/types'
import { Segmented } from '../../components/fields/controls'
import { Problems, TextField } from '../../components/fields/field'
import type { FieldErrors } from '../draft/build-spec'
import { number } from '../draft/settings'

export interface Measure {
  /** By name of the scenario; 1 if missing. */
  readonly weights: Readonly<Record<string, string>>
  readonly aggregate: string
}

interface MeasureFieldsProps extends Measure {
  readonly names: readonly string[]
  readonly errors: FieldErrors
  readonly onChange: (changes: Partial<Measure>) => void
}

export function MeasureFields({ names, weights, aggregate, errors, onChange }: MeasureFieldsProps) {
  const equal = names.every((name) => (weights[name] ?? '1') === '1')
  return (
    <>
      <Segmented
        roomy
        label="Judged by"
        value={aggregate}
        options={[
          ['mean', 'geometric mean'],
          ['worst', 'worst scenario'],
        ]}
        onChoose={(chosen) => onChange({ aggregate: chosen })}
      />
      {aggregate !== 'worst' && (
        <details>
          <summary>Weights of the scenarios{equal && ', all 1'}</summary>
          <div class="fields">
            {names.map((name) => (
              <TextField
                key={name}
                label={`Weight of ${name}`}
                inputMode="decimal"
                value={weights[name] ?? '1'}
                error={errors.get(`scenario_weights.${name}`)}
                onChange={(value) => onChange({ weights: { ...weights, [name]: value } })}
              />
            ))}
          </div>
        </details>
      )}
      <Problems messages={[errors.get('scenario_weights'), errors.get('scenario_aggregate')]} />
    </>
  )
}

/** Fields of a spec: weights other than 1, or the worst scenario. */
export function measureOf(
  names: readonly string[],
  { weights, aggregate }: Measure,
): Pick<Partial<JobSpec>, 'scenario_weights' | 'scenario_aggregate'> {
  if (aggregate === 'worst') return { scenario_aggregate: 'worst' }
  const others = names
    .map((name) => [name, number(weights[name]?.trim() || '1')] as const)
    .filter(([, weight]) => weight !== 1)
  const fields = Object.fromEntries(others) as JobSpec['scenario_weights']
  return others.length > 0 ? { scenario_weights: fields } : {}
}
