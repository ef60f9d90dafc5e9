/** What the runs say of the parameters as a whole, and which of them are to be shown. */

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
  found,
  chosen,
  onChoose,
  text,
  onText,
}: {
  found: Identifiability
  /** The verdict that is shown alone; null for all. */
  chosen: Trust | null
  onChoose: (trust: Trust | null) => void
  /** Words that the names shown must have. */
  text: string
  onText: (text: string) => void
}) {
  const count = found.parameters.length
  return (
    <section class="card stack verdict-card" aria-labelledby="verdicts">
      <h2 id="verdicts">Which parameters can be trusted</h2>
      {found.jobs.length === 1 ? (
        <OneRun />
      ) : (
        <dl class="verdicts">
          {verdicts(found)
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
        {found.jobs.length > 1 && (
          <Segmented<Trust | 'all'>
            label="Verdict"
            value={chosen ?? 'all'}
            options={[
              ['all', `all ${formatCount(count)}`],
              ...verdicts(found).map(({ trust, count }) => words(trust, count)),
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
      <strong>One run cannot tell.</strong>
      <p>
        A search gathers at some value of every parameter, whether or not the walks depend on it, so
        one run always narrows down. Only runs that differ in their seed and still find the same
        value show that it can be trusted: choose some above, or run this job with another seed.
      </p>
    </div>
  )
}
