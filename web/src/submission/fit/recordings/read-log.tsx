/** What was read of a measured log: how long it is, what it holds, and where the walk begins. */

import type { MeasuredWalk } from '../../../api/types'
import { Table } from '../../../components/table/table'
import { formatCount, formatNumber } from '../../../format/number'

/** Correlation of desired angles under which it is told that another walk may have been named. */
const SAME_WALK = 0.95

export function ReadLog({ read }: { read: MeasuredWalk }) {
  const { recording } = read
  return (
    <section class="stack-tight" aria-label="What was read" data-recording={recording.id}>
      <p role="status">
        {recording.synthetic ? 'A synthetic log, computed and not measured: ' : 'Read: '}
        {formatNumber(read.seconds, 4)} s in {formatCount(read.rows)} rows. The walk begins{' '}
        {formatNumber(Math.abs(read.offset), 3)} s {read.offset < 0 ? 'before' : 'into'} the log;{' '}
        {formatCount(read.cycles)} whole {read.cycles === 1 ? 'cycle' : 'cycles'} of{' '}
        {formatNumber(read.cycle_time, 3)} s, {formatNumber(recording.seconds, 4)} s in all, are
        compared. Mean current {formatNumber(recording.mean_current, 3)} A.
      </p>
      <p class={read.correlation < SAME_WALK ? 'wrong' : undefined}>
        Its desired angles and the simulated ones have a correlation of{' '}
        {formatNumber(read.correlation, 4)}
        {read.correlation < SAME_WALK &&
          ': much less than 1, so scenario, cycles or design may be those of another walk'}
        .
      </p>
      <Table
        caption="Signals of the log"
        rows={read.signals}
        rowKey={({ name }) => name}
        columns={[
          { key: 'name', label: 'Signal', header: true, value: (s) => s.name },
          { key: 'meaning', label: 'What it is', minor: true, value: (s) => s.description },
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
