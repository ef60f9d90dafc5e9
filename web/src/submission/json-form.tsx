/** JSON editor for a spec, also for kinds that the form does not support. */

import { useState } from 'preact/hooks'
import type { AnySpec } from '../api/types'
import { SubmitPanel } from './submit-panel'
import { useSubmission } from './use-submission'

export function JsonForm({ spec, onBack }: { spec: AnySpec; onBack?: () => void }) {
  const [text, setText] = useState(() => JSON.stringify(spec, null, 2))
  const [valid, setValid] = useState(spec)
  const [mistake, setMistake] = useState('')
  const submission = useSubmission(valid)
  const write = (next: string) => {
    setText(next)
    try {
      setValid(JSON.parse(next) as AnySpec)
      setMistake('')
    } catch (error) {
      setMistake(error instanceof Error ? error.message : 'this is not JSON')
    }
  }
  return (
    <form
      class="submission"
      noValidate
      onSubmit={(event) => {
        event.preventDefault()
        if (mistake === '') submission.submit()
      }}
    >
      <section class="card" aria-labelledby="part-json">
        <header class="row spread">
          <h2 id="part-json">Spec as JSON</h2>
          {onBack && (
            <button type="button" class="compact" onClick={onBack}>
              Back to the form, discarding changes
            </button>
          )}
        </header>
        <div class="field">
          <label class="visually-hidden" for="spec-text">
            Spec as JSON
          </label>
          <textarea
            id="spec-text"
            class="spec-text"
            spellcheck={false}
            value={text}
            aria-invalid={mistake !== ''}
            onInput={(event) => write(event.currentTarget.value)}
          />
          {mistake !== '' && (
            <span class="wrong" role="alert">
              {mistake}
            </span>
          )}
        </div>
      </section>
      <SubmitPanel spec={valid} submission={submission} />
    </form>
  )
}
