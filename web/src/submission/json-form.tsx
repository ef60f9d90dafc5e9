/** JSON editor for a spec, also for kinds that the form does not support. */

import { useState } from 'preact/hooks'
import type { AnySpec } from '../api/types'
import { Card } from '../components/card'
import { TextField } from '../components/fields/field'
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
      <Card
        title="Spec as JSON"
        tools={
          onBack && (
            <button type="button" class="compact" onClick={onBack}>
              Back to the form, discarding changes
            </button>
          )
        }
      >
        <TextField
          label={<span class="visually-hidden">Spec as JSON</span>}
          class="spec-text"
          rows={34}
          spellcheck={false}
          value={text}
          error={mistake || undefined}
          onChange={write}
        />
      </Card>
      <SubmitPanel spec={valid} submission={submission} />
    </form>
  )
}
