/** Descriptions of a job's objectives. */

import type { Job } from '../../api/types'
import { inWords } from '../../format/words'
import './notes.css'

export function ObjectiveNotes({ job }: { job: Job }) {
  return (
    <details class="small notes-fold">
      <summary>Descriptions of the objectives</summary>
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
