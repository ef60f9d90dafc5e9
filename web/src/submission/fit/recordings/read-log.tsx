/** Summary of an uploaded log. */

import type { MeasuredWalk } from '../../../api/types'
import { Table } from '../../../components/table/table'
import { formatCount, formatNumber } from '../../../format/number'

/** Correlation of desired angles below which the log probably shows another walk. */
const SAME_WALK = 0.95

export function ReadLog({ read }: { read: MeasuredWalk }) {
  const { recording } = read
  return (
    <section class="stack-tight" aria-label="Log summary" data-recording={recording.id}>
      <p role="status">
        {recording.synthetic ? 'Synthetic log, simulated rather than measured: ' : 'Log: '}
        {formatNumber(read.seconds, 4)} s in {formatCount(read.rows)} rows. The walk starts{' '}
        {formatNumber(Math.abs(read.offset), 3)} s {read.offset < 0 ? 'before' : 'into'} the log.{' '}
        {formatCount(read.cycles)} complete {read.cycles === 1 ? 'cycle' : 'cycles'} of{' '}
        {formatNumber(read.cycle_time, 3)} s are compared, {formatNumber(recording.seconds, 4)} s in
        total. Mean current: {formatNumber(recording.mean_current, 3)} A.
      </p>
      <p class={read.correlation < SAME_WALK ? 'wrong' : undefined}>
        Correlation of its desired angles with the simulated ones:{' '}
        {formatNumber(read.correlation, 4)}
        {read.correlation < SAME_WALK && '. This is low: check scenario, cycles and design'}.
      </p>
      <Table
        caption="Signals of the log"
        rows={read.signals}
        rowKey={({ name }) => name}
        columns={[
          { key: 'name', label: 'Signal', header: true, value: (s) => s.name },
          { key: 'meaning', label: 'Description', minor: true, value: (s) => s.description },
          { key: 'unit', label: 'Unit', value: (s) => s.unit },
          {
            key: 'channels',
            label: 'Channels',
            numeric: true,
            value: (s) => s.channels,
            cell: (s) => (s.channels === 0 ? 'not measured' : s.channels),
          },
        ]}
      />
    </section>
  )
}
