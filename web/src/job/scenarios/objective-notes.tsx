/** What each objective of a job is, in the API's words. */

import type { Job } from '../../api/types'
import { inWords } from '../../format/words'
import './notes.css'

export function ObjectiveNotes({ job }: { job: Job }) {
  return (
    <details class="small notes-fold">
      <summary>What the objectives are</summary>
      <dl class="notes">
        {job.objectives.map(({ name, description }) => (
          <div key={name}>
            <dt>{inWords(name)}</dt>
            <dd class="muted">{description}</dd>
          </div>
        ))}
      </dl>
    </details>
  )
}
