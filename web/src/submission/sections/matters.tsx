/** What matters: importance of the objectives, limits in units, and effort. */

import type { Estimate } from '../../api/types'
import { Card } from '../../components/card'
import { NumberField, Segmented } from '../../components/fields/controls'
import { Problems, TextField } from '../../components/fields/field'
import { Table } from '../../components/table/table'
import { Term } from '../../components/term'
import { Unit } from '../../components/text'
import { formatCount, percent } from '../../format/number'
import { capitalized, inWords } from '../../format/words'
import { weighed } from '../../job/preference'
import { errorsUnder } from '../draft/build-spec'
import { preferenceDraft } from '../draft/draft'
import { limitOf, withLimit } from '../draft/settings'
import type { SectionProps } from './settings'

/** What each preset favours, by the shares of its exponents. */
const FAVOURS: Readonly<Record<string, string>> = {
  A: 'smooth ride',
  B: 'steady body',
  C: 'all alike',
  'chapter-3': 'speed',
}

const GOALS: Readonly<Record<string, string>> = {
  torque: 'Low torque',
  acceleration: 'Smooth ride',
  angular_acceleration: 'Steady body',
  energy: 'Low energy',
  reciprocal_speed: 'Speed',
  height_loss: 'Level height',
}

const LIMITS = [
  ['speed', '>=', 'Speed at least', 'm/s'],
  ['energy', '<=', 'Energy at most', 'J/m'],
  ['peak_current', '<=', 'Peak current at most', 'A'],
  ['torque', '<=', 'Torque at most', 'N m'],
  ['acceleration', '<=', 'Acceleration at most', 'm/s2'],
] as const

const MOST_IMPORTANT = 2

export function MattersSection({ draft, catalogue, errors, onChange }: SectionProps) {
  const { preference, constraints } = draft
  const exponents = preference.exponent.map(Number)
  const sum = exponents.reduce((a, b) => a + b, 0)
  const choose = (kind: string) =>
    onChange({
      preference: kind === 'custom' ? { ...preference, kind } : preferenceDraft(catalogue, kind),
    })
  return (
    <Card
      title={
        <>
          <b class="step">2</b> What matters
        </>
      }
      note={
        <>
          The <Term name="preference" /> says how much objectives count; a limit is a{' '}
          <Term name="constraint" />.
        </>
      }
    >
      <div class="stack">
        <Segmented
          roomy
          label="Preference"
          value={preference.kind}
          options={[
            ...catalogue.preferences.map(
              ({ name }) => [name, name in FAVOURS ? `${name} · ${FAVOURS[name]}` : name] as const,
            ),
            ['custom', 'custom'] as const,
          ]}
          onChoose={choose}
        />
        <Problems messages={errorsUnder(errors, 'preference')} />
        <div class="matters">
          <div class="goals">
            {weighed(preference).map((objective, k) => (
              <label key={objective}>
                <span>{GOALS[objective]}</span>
                <input
                  type="range"
                  min={0}
                  max={Math.max(MOST_IMPORTANT, exponents[k] || 0)}
                  step={0.05}
                  value={exponents[k]}
                  aria-label={`Importance of ${GOALS[objective].toLowerCase()}`}
                  aria-valuetext={percent(exponents[k] / sum, 2)}
                  onInput={({ currentTarget: { value } }) => {
                    const exponent = preference.exponent.map((old, m) => (m === k ? value : old))
                    onChange({ preference: { ...preference, kind: 'custom', exponent } })
                  }}
                />
                <output>{percent(exponents[k] / sum, 2)}</output>
              </label>
            ))}
          </div>
          <fieldset>
            <legend>Limits in every scenario, optional</legend>
            <div class="fields limits">
              {LIMITS.map(([quantity, sign, label, unit]) => (
                <TextField
                  key={quantity}
                  label={
                    <>
                      {label}
                      <Unit unit={unit} />
                    </>
                  }
                  inputMode="decimal"
                  value={limitOf(constraints, quantity, sign)}
                  onChange={(limit) =>
                    onChange({ constraints: withLimit(constraints, quantity, sign, limit) })
                  }
                />
              ))}
            </div>
          </fieldset>
        </div>
      </div>
    </Card>
  )
}

/** Durations that are offered [s]. */
const EFFORTS = [
  [10, '10 s'],
  [30, '30 s'],
  [120, '2 min'],
  [600, '10 min'],
] as const

/** pace: of evaluation [s per design]; null if unknown. */
export function EffortSection({ draft, onChange, pace }: SectionProps & { pace: number | null }) {
  const batch = Number(draft.optimizer.particles)
  const iterations = Number(draft.iterations)
  const iterationsIn = (seconds: number) =>
    String(Math.max(1, Math.round(seconds / (pace! * batch))))
  const lasting = (seconds: number) => onChange({ iterations: iterationsIn(seconds) })
  return (
    <Card title="Effort">
      <div class="stack">
        {pace !== null && batch > 0 && (
          // biome-ignore lint/a11y/noStaticElementInteractions: Enter sets the effort, without submitting
          <div
            class="row"
            onKeyDown={(event) => {
              if (event.key !== 'Enter' || !(event.target instanceof HTMLInputElement)) return
              event.preventDefault()
              event.target.blur()
            }}
          >
            <Segmented
              roomy
              label="Effort"
              value={EFFORTS.flatMap(([s]) =>
                iterationsIn(s) === draft.iterations ? [String(s)] : [],
              )}
              options={EFFORTS.map(([s, text]) => [String(s), text] as const)}
              onChoose={(seconds) => lasting(Number(seconds))}
            />
            <NumberField
              narrow
              label="Effort in seconds"
              min={1}
              value={Math.round(pace * batch * iterations)}
              onChange={(text) => Number(text) > 0 && lasting(Number(text))}
            />
            <span>seconds</span>
          </div>
        )}
        <p data-designs={batch * iterations}>
          {formatCount(batch * iterations)} designs in {formatCount(iterations)} batch
          {iterations === 1 ? '' : 'es'}
          <span class="muted">; each design is simulated in every scenario.</span>
        </p>
      </div>
    </Card>
  )
}

/** Pace of an estimate [s per design]; null if unknown. */
export function paceOf(estimate: Estimate | null): number | null {
  return estimate?.seconds ? estimate.seconds / estimate.evaluations : null
}

/** Biases and exponents as numbers. */
export function ExactPreferenceSection({ draft, errors, onChange }: SectionProps) {
  const { preference } = draft
  const objectives = weighed(preference)
  const weight = (part: 'bias' | 'exponent', objective: string) => {
    const index = objectives.indexOf(objective)
    const error = errors.get(`preference.${part}.${index}`)
    return (
      <>
        <input
          class="short"
          inputMode="decimal"
          aria-label={`${part} of ${inWords(objective)}`}
          aria-invalid={error !== undefined}
          value={preference[part][index]}
          onInput={({ currentTarget: { value } }) => {
            const values = preference[part].map((old, k) => (k === index ? value : old))
            onChange({ preference: { ...preference, kind: 'custom', [part]: values } })
          }}
        />
        {error !== undefined && <span class="wrong"> {error}</span>}
      </>
    )
  }
  return (
    <Card title="Preference in numbers">
      <Table<string>
        caption="Biases and exponents of the objectives"
        rows={objectives}
        columns={[
          { key: 'objective f', header: true, cell: (name) => capitalized(inWords(name)) },
          { key: 'bias b, in the unit of f', cell: (objective) => weight('bias', objective) },
          { key: 'exponent e', cell: (objective) => weight('exponent', objective) },
        ]}
      />
      <p class="muted small">
        A scenario’s utility is the product of (b + f)<sup>e</sup>; the fitness is their geometric
        mean, or that of the worst scenario.
      </p>
    </Card>
  )
}
