/** Sliders for biases and exponents, and a choice of published preferences. */

import type { Preference, PreferencePreset } from '../../api/types'
import { NumberField } from '../../components/fields/number-field'
import { Segmented } from '../../components/fields/segmented'
import { writtenUnit } from '../../format/number'
import { inWords } from '../../format/words'
import { weighed } from '../preference'

type Part = 'bias' | 'exponent'

/** Range of the sliders, extended to the current value; fields accept any value that the API accepts. */
const REACH = 2

export function PreferenceSliders({
  preference,
  jobPreference,
  presets,
  units,
  onChange,
}: {
  preference: Preference
  /** The job's preference. */
  jobPreference: Preference
  presets: readonly PreferencePreset[]
  units: ReadonlyMap<string, string>
  onChange: (preference: Preference) => void
}) {
  const change = (part: Part, index: number, value: number) => {
    if (!Number.isFinite(value) || value < 0) return
    const values = [...preference[part]]
    values[index] = value
    onChange({ ...preference, [part]: values as Preference[Part] })
  }
  const offered: readonly (readonly [name: string, preference: Preference])[] = [
    ['job’s preference', jobPreference],
    ...presets.map((preset) => [preset.name, preset] as const),
  ]
  return (
    <section class="card" aria-labelledby="weights">
      <h2 id="weights">Preference</h2>
      <div class="stack">
        <p class="muted small">
          A scenario’s utility is the product of (b + f)<sup>e</sup> over the objectives f. A larger
          e increases the weight of an objective; a larger b reduces the influence of small values.
        </p>
        <Segmented
          label="Published preferences"
          value={offered.flatMap(([name, each]) => (same(preference, each) ? [name] : []))}
          options={offered.map(([name]) => [name, name] as const)}
          onChoose={(chosen) => onChange(weights(offered.find(([name]) => name === chosen)![1]))}
        />
        {weighed(preference).map((objective, index) => (
          <fieldset key={objective}>
            <legend>{inWords(objective)}</legend>
            <Weight
              label="b"
              name={`bias of ${inWords(objective)}`}
              unit={units.get(objective) ?? '1'}
              value={preference.bias[index]}
              onChange={(value) => change('bias', index, value)}
            />
            <Weight
              label="e"
              name={`exponent of ${inWords(objective)}`}
              unit="1"
              value={preference.exponent[index]}
              onChange={(value) => change('exponent', index, value)}
            />
          </fieldset>
        ))}
      </div>
    </section>
  )
}

function Weight({
  label,
  name,
  unit,
  value,
  onChange,
}: {
  label: string
  name: string
  unit: string
  value: number
  onChange: (value: number) => void
}) {
  return (
    <div class="weight">
      <span aria-hidden="true">{label}</span>
      <input
        type="range"
        min={0}
        max={Math.max(REACH, value)}
        step={0.01}
        value={value}
        aria-label={name}
        onInput={(event) => onChange(event.currentTarget.valueAsNumber)}
      />
      <NumberField
        label={`${name}, number`}
        value={Number(value.toPrecision(6))}
        min={0}
        step={0.01}
        onChange={(text) => onChange(text === '' ? Number.NaN : Number(text))}
      />
      <span class="unit">{unit === '1' ? '' : writtenUnit(unit)}</span>
    </div>
  )
}

function weights({ bias, exponent }: Preference): Preference {
  return { bias, exponent }
}

export function same(a: Preference, b: Preference): boolean {
  const equal = (x: readonly number[], y: readonly number[]) =>
    x.length === y.length && x.every((v, k) => v === y[k])
  return equal(a.bias, b.bias) && equal(a.exponent, b.exponent)
}
