/** The selected recordings: uploaded here, or stored on the server. */

import type { Resource } from '../../../api/resource'
import type { RecordingView } from '../../../api/types'
import { Card, Loaded } from '../../../components/card'
import { Combobox } from '../../../components/fields/combobox'
import { RemovableList } from '../../../components/fields/removable-list'
import { formatNumber } from '../../../format/number'
import { idsIn, recordingSearch, shortId } from './recording-search'

interface RecordingsCardProps {
  ids: readonly string[]
  recordings: Resource<readonly RecordingView[]>
  onChange: (ids: readonly string[]) => void
}

export function RecordingsCard({ ids, recordings, onChange }: RecordingsCardProps) {
  return (
    <Card class="stack" title="Recordings to fit">
      {ids.length === 0 && (
        <p class="muted">None yet: upload a log above, or select a stored recording.</p>
      )}
      <Loaded resource={recordings} what="the recordings" />
      <RemovableList ids={ids} short={shortId} onChange={onChange}>
        {(id) => inWords(recordings.data?.find((recording) => recording.id === id))}
      </RemovableList>
      <div class="fields">
        <Combobox
          label="Stored recordings"
          placeholder="scenario, controller or id"
          remote={{ label: 'Recordings, newest first', search: recordingSearch(ids) }}
          hint="You can paste several ids at once."
          onChoose={(id) => onChange([...ids, id])}
          onPaste={(text) => {
            const pasted = idsIn(text).filter((id) => !ids.includes(id))
            if (pasted.length > 0) onChange([...ids, ...pasted])
            return pasted.length > 0
          }}
        />
      </div>
    </Card>
  )
}

function inWords(recording: RecordingView | undefined): string {
  if (!recording) return ''
  const { scenario, controller, seconds, mean_current, synthetic } = recording
  const length = `${formatNumber(seconds, 3)} s of ${scenario} with ${controller}`
  return `${length}, ${formatNumber(mean_current, 3)} A${synthetic ? ', synthetic' : ''}`
}
