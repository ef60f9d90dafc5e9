/** Estimate, problems and submission of a job. */

import type { ComponentChildren } from 'preact'
import { ApiProblem } from '../api/problem'
import type { AnySpec } from '../api/types'
import { CopyButton } from '../components/copy-button'
import { ErrorNotice } from '../components/feedback'
import { TextField } from '../components/fields/field'
import { formatCount } from '../format/number'
import { formatDuration } from '../format/time'
import { HIGHEST, isPriority, LOWEST, PRIORITY_ERROR, PRIORITY_HELP } from '../job/facts'
import { NOTIFY, type Submission } from './use-submission'

interface SubmitPanelProps {
  spec: AnySpec
  submission: Submission
  /** What must be entered first; empty if nothing. */
  missing?: string
  onJson?: () => void
  children?: ComponentChildren
}

export function SubmitPanel({
  spec,
  submission,
  missing = '',
  onJson,
  children,
}: SubmitPanelProps) {
  const { estimate, problem, sending } = submission
  const json = JSON.stringify(spec, null, 2)
  return (
    <aside class="card submit-panel stack" aria-label="Estimate and submission">
      {children}
      <div aria-live="polite">
        <h2>Estimate</h2>
        {estimate ? (
          <>
            <dl class="estimate" data-walks={estimate.walks}>
              {[
                [
                  'Duration (approx.)',
                  estimate.seconds === null ? 'unknown' : formatDuration(estimate.seconds),
                ],
                ['Evaluations', formatCount(estimate.evaluations)],
                ['Simulations', formatCount(estimate.walks)],
                ['Simulated time', formatDuration(estimate.simulated_seconds)],
              ].map(([label, value]) => (
                <div key={label}>
                  <dt>{label}</dt>
                  <dd>{value}</dd>
                </div>
              ))}
            </dl>
            <p class="muted small">{estimate.basis}</p>
          </>
        ) : (
          problem === null && <p class="muted">{missing || 'Asking…'}</p>
        )}
        {problem !== null && <ErrorNotice what={advice(problem)} error={problem} />}
      </div>
      <button type="submit" class="primary" disabled={sending || missing !== ''}>
        {sending ? 'Submitting…' : 'Submit the job'}
      </button>
      <details open={!isPriority(submission.priority) || problemOf(problem, NOTIFY) !== undefined}>
        <summary>Priority and webhook</summary>
        <TextField
          label="Priority"
          inputMode="numeric"
          value={submission.priority}
          title={PRIORITY_HELP}
          hint={`${LOWEST} to ${HIGHEST}; higher runs first`}
          error={isPriority(submission.priority) ? undefined : PRIORITY_ERROR}
          onChange={submission.setPriority}
        />
        <TextField
          label="Webhook"
          value={submission.notify}
          hint="called when the job ends; the server must allow the host"
          error={problemOf(problem, NOTIFY)}
          onChange={submission.setNotify}
        />
      </details>
      <details>
        <summary>Spec as JSON</summary>
        <div class="stack-tight">
          <span class="row">
            <CopyButton text={json} label="the spec" />
            {onJson && (
              <button type="button" class="compact" onClick={onJson}>
                Edit as JSON
              </button>
            )}
          </span>
          <pre class="spec-json" tabIndex={0}>
            {json}
          </pre>
        </div>
      </details>
    </aside>
  )
}

function problemOf(problem: unknown, field: string): string | undefined {
  const errors = problem instanceof ApiProblem ? problem.errors : []
  return errors.find((error) => error.field === field)?.message
}

function advice(problem: unknown): string {
  if (problem instanceof ApiProblem && problem.status === 422) return 'Please correct:'
  return 'Could not validate the job.'
}
