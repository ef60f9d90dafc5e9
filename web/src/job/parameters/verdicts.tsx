/** Summary of the verdicts, and filters of the parameters. */

import type { Identifiability } from '../../api/types'
import { Segmented } from '../../components/fields/segmented'
import { formatCount } from '../../format/number'
import { type Trust, verdicts } from './intervals'

const TONES: Readonly<Record<Trust, 'good' | 'warn' | 'muted'>> = {
  trusted: 'good',
  rough: 'warn',
  unknown: 'muted',
}

export function TrustBadge({ trust }: { trust: Trust }) {
  return (
    <span class="badge" data-tone={TONES[trust]} data-trust={trust}>
      {trust}
    </span>
  )
}

export function Verdicts({
  identifiability,
  chosen,
  onChoose,
  text,
  onText,
}: {
  identifiability: Identifiability
  /** Verdict to filter by; null for all. */
  chosen: Trust | null
  onChoose: (trust: Trust | null) => void
  /** Text to filter names by. */
  text: string
  onText: (text: string) => void
}) {
  const count = identifiability.parameters.length
  return (
    <section class="card stack verdict-card" aria-labelledby="verdicts">
      <h2 id="verdicts">Confidence in the parameters</h2>
      {identifiability.jobs.length === 1 ? (
        <OneRun />
      ) : (
        <dl class="verdicts">
          {verdicts(identifiability)
            .filter((verdict) => verdict.count > 0)
            .map(({ trust, count, explanation }) => (
              <div key={trust} data-verdict={trust} data-count={count}>
                <dt>
                  <TrustBadge trust={trust} /> <strong>{formatCount(count)}</strong>
                </dt>
                <dd>{explanation}</dd>
              </div>
            ))}
        </dl>
      )}
      <search class="row">
        <label>
          <span class="visually-hidden">Find a parameter</span>
          <input
            type="search"
            placeholder="Find a parameter"
            value={text}
            onInput={(event) => onText(event.currentTarget.value)}
          />
        </label>
        {identifiability.jobs.length > 1 && (
          <Segmented<Trust | 'all'>
            label="Verdict"
            value={chosen ?? 'all'}
            options={[
              ['all', `all ${formatCount(count)}`],
              ...verdicts(identifiability).map(({ trust, count }) => words(trust, count)),
            ]}
            onChoose={(trust) => onChoose(trust === 'all' ? null : trust)}
          />
        )}
      </search>
    </section>
  )
}

function words(trust: Trust, count: number): readonly [Trust, string] {
  return [trust, `${trust} ${formatCount(count)}`]
}

function OneRun() {
  return (
    <div class="notice" data-tone="warn" data-single-run>
      <strong>One run is not enough.</strong>
      <p>
        A search converges to some value of every parameter, whether or not the results depend on
        it. Only agreement between runs with different seeds shows that a value can be trusted:
        select other runs above, or run this job with another seed.
      </p>
    </div>
  )
}
