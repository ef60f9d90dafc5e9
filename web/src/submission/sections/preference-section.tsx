/** Weights of the objectives: a published preference or custom values. */

import { Segmented } from '../../components/fields/segmented'
import { formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import { weighed } from '../../job/preference'
import { type PreferenceDraft, preferenceDraft } from '../draft/draft'
import { Problems } from '../fields/number-field'
import type { SectionProps } from './section'

export function PreferenceSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { preference } = draft
  const names = catalogue.preferences.map(({ name }) => name)
  const change = (part: 'bias' | 'exponent', index: number, value: string) => {
    const values = preference[part].map((old, k) => (k === index ? value : old))
    onChange({ preference: { ...preference, [part]: values } })
  }
  return (
    <section class="card" aria-labelledby="part-preference">
      <h2 id="part-preference">Preference</h2>
      <div class="stack">
        <Segmented
          roomy
          label="Preference"
          value={preference.kind}
          options={[...names, 'custom'].map((name) => [name, name] as const)}
          onChoose={(kind) =>
            onChange({
              preference:
                kind === 'custom' ? { ...preference, kind } : preferenceDraft(catalogue, kind),
            })
          }
        />
        <Problems messages={errors.has('preference') ? [errors.get('preference')!] : []} />
        <div class="table-scroll">
          <table class="variables">
            <caption class="visually-hidden">Biases and exponents of the objectives</caption>
            <thead>
              <tr>
                <th scope="col">Objective f</th>
                <th scope="col">Bias b, in the unit of f</th>
                <th scope="col">Exponent e</th>
              </tr>
            </thead>
            <tbody>
              {weighed(preference).map((objective, index) => (
                <tr key={objective}>
                  <th scope="row">{inWords(objective)}</th>
                  {(['bias', 'exponent'] as const).map((part) => (
                    <td key={part}>
                      <Weight
                        preference={preference}
                        part={part}
                        index={index}
                        label={`${part} of ${inWords(objective)}`}
                        error={errors.get(`preference.${part}.${index}`)}
                        onChange={(value) => change(part, index, value)}
                      />
                    </td>
                  ))}
                </tr>
              ))}
            </tbody>
          </table>
        </div>
        <p class="muted small">
          A scenario’s utility is the product of (b + f)<sup>e</sup>; the fitness is the geometric
          mean over the scenarios.
        </p>
      </div>
    </section>
  )
}

function Weight({
  preference,
  part,
  index,
  label,
  error,
  onChange,
}: {
  preference: PreferenceDraft
  part: 'bias' | 'exponent'
  index: number
  label: string
  error: string | undefined
  onChange: (value: string) => void
}) {
  const value = preference[part][index]
  if (preference.kind !== 'custom') return <>{formatExact(Number(value))}</>
  return (
    <>
      <input
        class="short"
        inputMode="decimal"
        aria-label={label}
        aria-invalid={error !== undefined}
        value={value}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
      {error !== undefined && <span class="wrong"> {error}</span>}
    </>
  )
}
