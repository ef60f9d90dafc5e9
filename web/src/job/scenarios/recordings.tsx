/** Recordings that an identification is fitted to. */

import { get } from '../../api/client'
import { type Resource, useResource } from '../../api/resource'
import type { Job, RecordingView } from '../../api/types'
import { ErrorNotice, Loading } from '../../components/feedback'
import { Table } from '../../components/table/table'
import { formatNumber } from '../../format/number'

/** A recording without its samples. */
export interface RecordingSummary extends RecordingView {
  /** Name in the results: the beginning of its id. */
  readonly caseName: string
}

/** Recordings of an identification, in its order; no requests for other jobs. */
export function useRecordings(job: Job): Resource<readonly RecordingSummary[]> {
  const { spec } = job
  const ids = spec.kind === 'identification' ? spec.recordings : []
  return useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    Promise.all(
      ids.map((id, k) =>
        get('/v1/recordings/{recording_id}/summary', {
          path: { recording_id: id },
          signal,
        }).then((recording) => ({ ...recording, caseName: job.scenarios[k] })),
      ),
    ),
  )
}

/** Label of a case; for a recording with its scenario. */
export function caseLabel(
  caseName: string,
  recordings: readonly RecordingSummary[] | null,
): string {
  const match = recordings?.find((recording) => recording.caseName === caseName)
  return match ? `${match.scenario} (${caseName})` : caseName
}

export function RecordingsCard({
  recordings,
}: {
  recordings: Resource<readonly RecordingSummary[]>
}) {
  return (
    <section class="card" aria-labelledby="recordings">
      <h2 id="recordings">Recordings</h2>
      {recordings.loading && <Loading what="the recordings" />}
      {recordings.error && (
        <ErrorNotice
          what="Could not load the recordings."
          error={recordings.error}
          retry={recordings.reload}
        />
      )}
      {recordings.data && (
        <Table
          caption="Recordings"
          rows={recordings.data}
          rowKey={({ caseName }) => caseName}
          columns={[
            { key: 'case', label: 'Recording', header: true, value: (r) => r.caseName },
            { key: 'scenario', label: 'Scenario', value: (r) => r.scenario },
            { key: 'controller', label: 'Controller', minor: true, value: (r) => r.controller },
            {
              key: 'source',
              label: 'Source',
              minor: true,
              value: (r) => (r.synthetic ? 'simulated' : 'measured'),
            },
            {
              key: 'seconds',
              label: 'Duration',
              unit: 's',
              numeric: true,
              value: (r) => r.seconds,
              cell: (r) => formatNumber(r.seconds, 3),
            },
            {
              key: 'current',
              label: 'Mean current',
              unit: 'A',
              numeric: true,
              value: (r) => r.mean_current,
              cell: (r) => formatNumber(r.mean_current, 3),
            },
          ]}
        />
      )}
    </section>
  )
}
