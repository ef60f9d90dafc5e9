/** The recorded walks that an identification is fitted to. */

import { get } from '../api/client'
import { type Resource, useResource } from '../api/resource'
import type { Job, RecordedWalk } from '../api/types'
import { ErrorNotice, Loading } from '../components/feedback'
import { Table } from '../components/table'
import { formatNumber } from '../format/number'

/** A recording in short; its currents are many. */
export interface RecordingSummary {
  /** As results name it: the beginning of its id. */
  readonly caseName: string
  readonly scenario: string
  readonly controller: string
  /** Time that is compared [s]. */
  readonly seconds: number
  /** Mean absolute motor current [A]. */
  readonly current: number
  readonly synthetic: boolean
}

/** Rows of a recording in a second. */
const RATE = 500

/** Those of the job, in its order; of other jobs none are asked for. */
export function useRecordings(job: Job): Resource<readonly RecordingSummary[]> {
  const { spec } = job
  const ids = spec.kind === 'identification' ? spec.recordings : []
  return useResource(ids.length === 0 ? null : ids.join(), (signal) =>
    Promise.all(
      ids.map((id, k) =>
        get('/v1/recordings/{recording_id}', { path: { recording_id: id }, signal }).then((walk) =>
          summaryOf(job.scenarios[k], walk),
        ),
      ),
    ),
  )
}

/** What a case is called: a recording also by the scenario that was walked. */
export function caseLabel(
  caseName: string,
  recordings: readonly RecordingSummary[] | null,
): string {
  const found = recordings?.find((recording) => recording.caseName === caseName)
  return found ? `${found.scenario} (${caseName})` : caseName
}

function summaryOf(caseName: string, { scenario, controller, current, synthetic }: RecordedWalk) {
  const numbers = current.flat()
  return {
    caseName,
    scenario: scenario.name,
    controller,
    seconds: current.length / RATE,
    current: numbers.reduce((sum, value) => sum + Math.abs(value), 0) / numbers.length,
    synthetic,
  }
}

export function RecordingsCard({
  recordings,
}: {
  recordings: Resource<readonly RecordingSummary[]>
}) {
  return (
    <section class="card" aria-labelledby="recordings">
      <h2 id="recordings">What was recorded</h2>
      {recordings.loading && <Loading what="the recordings" />}
      {recordings.error && (
        <ErrorNotice
          what="The recordings cannot be shown."
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
              label: 'Compared',
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
              value: (r) => r.current,
              cell: (r) => formatNumber(r.current, 3),
            },
          ]}
        />
      )}
    </section>
  )
}
