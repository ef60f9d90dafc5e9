/** Designs that the search begins with: the best of earlier jobs, or those of a cloned one. */

import { useId } from 'preact/hooks'
import { formatCount } from '../format/number'
import { errorsUnder } from './build-spec'
import { Problems } from './number-field'
import type { SectionProps } from './section'
import { NO_START, type StartDraft } from './start'

export function StartSection({ draft, errors, onChange }: SectionProps) {
  const id = useId()
  const { start } = draft
  const problems = errorsUnder(errors, 'start')
  const wrong = problems.length > 0
  const change = (changes: Partial<StartDraft>) => onChange({ start: { ...start, ...changes } })
  return (
    <section class="card" aria-labelledby="part-start">
      <h2 id="part-start">Start</h2>
      <div class="fields">
        <div class="field wide">
          <label for={`${id}-jobs`}>From the best of jobs</label>
          <input
            id={`${id}-jobs`}
            value={start.jobs}
            placeholder="ids, separated by commas; none: the search begins anywhere"
            aria-invalid={wrong}
            aria-describedby={`${id}-hint`}
            onInput={(event) => change({ jobs: event.currentTarget.value })}
          />
          <span id={`${id}-hint`} class="hint">
            Their best designs are judged first, as part of the budget.
          </span>
        </div>
        {start.jobs.trim() !== '' && (
          <div class="field">
            <label for={`${id}-count`}>Designs in all</label>
            <input
              id={`${id}-count`}
              inputMode="numeric"
              value={start.count}
              aria-invalid={wrong}
              onInput={(event) => change({ count: event.currentTarget.value })}
            />
          </div>
        )}
      </div>
      {start.designs.length > 0 && start.jobs.trim() === '' && (
        <p class="row">
          <span>
            It begins with the {formatCount(start.designs.length)} designs that the cloned job began
            with.
          </span>
          <button type="button" class="compact" onClick={() => onChange({ start: NO_START })}>
            Leave them out
          </button>
        </p>
      )}
      <Problems messages={problems} />
    </section>
  )
}
