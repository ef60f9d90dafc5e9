/** Weights of the objectives: a published preference or custom values. */

import { Card } from '../../components/card'
import { Segmented } from '../../components/fields/controls'
import { Problems } from '../../components/fields/field'
import { Table } from '../../components/table/table'
import { formatExact } from '../../format/number'
import { inWords } from '../../format/words'
import { weighed } from '../../job/preference'
import { preferenceDraft } from '../draft/draft'
import type { SectionProps } from './settings'

export function PreferenceSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { preference } = draft
  const objectives = weighed(preference)
  const weight = (part: 'bias' | 'exponent', objective: string) => {
    const index = objectives.indexOf(objective)
    const value = preference[part][index]
    if (preference.kind !== 'custom') return formatExact(Number(value))
    const error = errors.get(`preference.${part}.${index}`)
    const change = (text: string) => {
      const values = preference[part].map((old, k) => (k === index ? text : old))
      onChange({ preference: { ...preference, [part]: values } })
    }
    return (
      <>
        <input
          class="short"
          inputMode="decimal"
          aria-label={`${part} of ${inWords(objective)}`}
          aria-invalid={error !== undefined}
          value={value}
          onInput={(event) => change(event.currentTarget.value)}
        />
        {error !== undefined && <span class="wrong"> {error}</span>}
      </>
    )
  }
  return (
    <Card title="Preference">
      <div class="stack">
        <Segmented
          roomy
          label="Preference"
          value={preference.kind}
          options={[...catalogue.preferences.map(({ name }) => name), 'custom'].map(
            (name) => [name, name] as const,
          )}
          onChoose={(kind) =>
            onChange({
              preference:
                kind === 'custom' ? { ...preference, kind } : preferenceDraft(catalogue, kind),
            })
          }
        />
        <Problems messages={[errors.get('preference')]} />
        <Table<string>
          caption="Biases and exponents of the objectives"
          rows={objectives}
          columns={[
            { key: 'objective f', header: true, cell: inWords },
            { key: 'bias b, in the unit of f', cell: (objective) => weight('bias', objective) },
            { key: 'exponent e', cell: (objective) => weight('exponent', objective) },
          ]}
        />
        <p class="muted small">
          A scenario’s utility is the product of (b + f)<sup>e</sup>; the fitness is the geometric
          mean over the scenarios.
        </p>
      </div>
    </Card>
  )
}
