/** The recordings that a robot is fitted to: those that were read here, and others by their ids. */

import { useState } from 'preact/hooks'
import type { Resource } from '../../api/resource'
import type { RecordingView } from '../../api/types'
import { ChosenList } from '../../components/chosen-list'
import { ErrorNotice, Loading } from '../../components/feedback'
import { formatNumber } from '../../format/number'
import { words } from './fit'
import { TextField } from './text-field'

export function ChosenCard({
  ids,
  recordings,
  onChange,
}: {
  ids: readonly string[]
  recordings: Resource<readonly RecordingView[]>
  onChange: (ids: readonly string[]) => void
}) {
  const [typed, setTyped] = useState('')
  return (
    <form
      class="card stack"
      noValidate
      aria-labelledby="part-recordings"
      onSubmit={(event) => {
        event.preventDefault()
        onChange([...ids, ...words(typed)])
        setTyped('')
      }}
    >
      <h2 id="part-recordings">Recordings to fit to</h2>
      {ids.length === 0 && (
        <p class="muted">None yet: read a measured walk above, or add one by its id.</p>
      )}
      {recordings.loading && <Loading what="the recordings" />}
      {recordings.error && (
        <ErrorNotice
          what="A recording cannot be looked at."
          error={recordings.error}
          retry={recordings.reload}
        />
      )}
      <ChosenList ids={ids} short={(id) => id.slice(0, 12)} onChange={onChange}>
        {(id) => inWords(recordings.data?.find((recording) => recording.id === id))}
      </ChosenList>
      <div class="row">
        <TextField
          label="Others"
          value={typed}
          hint="ids that gaitswarm record printed, separated by commas"
          onChange={setTyped}
        />
        <button type="submit" class="compact" disabled={words(typed).length === 0}>
          Add
        </button>
      </div>
    </form>
  )
}

function inWords(recording: RecordingView | undefined): string {
  if (!recording) return ''
  const { scenario, controller, seconds, mean_current, synthetic } = recording
  const length = `${formatNumber(seconds, 3)} s of ${scenario} with ${controller}`
  return `${length}, ${formatNumber(mean_current, 3)} A${synthetic ? ', synthetic' : ''}`
}
