/** Choosing a design: published ones, and the best ones of jobs. */

import { useId } from 'preact/hooks'
import { get } from '../api/client'
import { jobsOfKind } from '../api/jobs-of-kind'
import { useResource } from '../api/resource'
import { type DesignSource, sourceOfWord, wordOf } from './design-source'

export function DesignPicker({
  label,
  chosen,
  chosenLabel,
  none,
  note,
  onChoose,
}: {
  label: string
  chosen: DesignSource | null
  /** How to call what is chosen if it is in neither list. */
  chosenLabel: string
  /** What the choice of no design is called; without it there must be one. */
  none?: string
  /** Why published designs are not offered; without it they are. */
  note?: string
  onChoose: (source: DesignSource | null) => void
}) {
  const id = useId()
  const controllers = useResource('controllers', (signal) => get('/v1/controllers', { signal }))
  const jobs = useResource('jobs', (signal) => jobsOfKind('tuning', signal))
  const published = (controllers.data?.items ?? []).flatMap((controller) =>
    Object.keys(controller.published).map((study) => ({
      word: wordOf({ kind: 'published', controller: controller.name, study }),
      text: `${controller.name}: ${study}`,
    })),
  )
  const best = (jobs.data ?? [])
    .filter((job) => job.best_fitness !== null)
    .map((job) => ({ word: wordOf({ kind: 'best', job: job.id }), text: job.name || job.id }))
  const word = chosen ? wordOf(chosen) : ''
  const listed = word === '' || [...published, ...best].some((option) => option.word === word)
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <select
        id={id}
        value={word}
        onChange={(event) => onChoose(sourceOfWord(event.currentTarget.value))}
      >
        {none !== undefined && <option value="">{none}</option>}
        {!listed && <option value={word}>{chosenLabel}</option>}
        {note === undefined && <Options label="Published designs" options={published} />}
        <Options label="Best of a job" options={best} />
      </select>
      {note !== undefined && <span class="hint">{note}</span>}
    </div>
  )
}

function Options({
  label,
  options,
}: {
  label: string
  options: readonly { readonly word: string; readonly text: string }[]
}) {
  if (options.length === 0) return null
  return (
    <optgroup label={label}>
      {options.map(({ word, text }) => (
        <option key={word} value={word}>
          {text}
        </option>
      ))}
    </optgroup>
  )
}
