/** Targets of a calibration compared with its best design. */

import { get } from '../../api/client'
import { usePolling, useResource } from '../../api/resource'
import type { Job, TargetResult, Targets } from '../../api/types'
import { Empty, ErrorNotice, Loading } from '../../components/feedback'
import { type Column, Table } from '../../components/table/table'
import { change, formatExact, formatNumber, percent, quantity } from '../../format/number'
import { placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { isRunning } from '../state'
import { isWithin, LEFT_OUT, type LeaveOut, leaveOutOf, withinCount } from './targets'

/** Polling interval while the job runs [ms]. */
const RENEW_MS = 15_000

export function TargetsPanel({ job }: { job: Job }) {
  if (!job.best) {
    return (
      <section class="card">
        <Empty title="Nothing to compare yet">
          <p>No design has succeeded in every walk yet. The first one that does appears here.</p>
        </Empty>
      </section>
    )
  }
  return <Compared job={job} />
}

function Compared({ job }: { job: Job }) {
  const leaveOut = leaveOutOf(usePlace().query)
  const targets = useResource(`${job.id} ${leaveOut}`, (signal) =>
    get('/v1/jobs/{job_id}/targets', {
      path: { job_id: job.id },
      query: leaveOut === null ? {} : { leave_out: leaveOut },
      signal,
    }),
  )
  usePolling(targets.reload, RENEW_MS, isRunning(job))
  return (
    <section class="card" aria-labelledby="targets">
      <header class="row spread">
        <h2 id="targets">Targets</h2>
        <LeaveOutPicker chosen={leaveOut} />
      </header>
      {targets.error && (
        <ErrorNotice
          what="Could not load the targets."
          error={targets.error}
          retry={targets.reload}
        />
      )}
      {targets.loading && !targets.data && <Loading what="the targets" />}
      {targets.data && <TargetsTable targets={targets.data} predicts={leaveOut !== null} />}
    </section>
  )
}

function LeaveOutPicker({ chosen }: { chosen: LeaveOut | null }) {
  return (
    <label class="row">
      <span class="label">Predict each target without</span>
      <select
        value={chosen ?? ''}
        onChange={(event) => setQuery({ leave_out: event.currentTarget.value || null })}
      >
        <option value="">nothing: compare only</option>
        {LEFT_OUT.map(({ what, words }) => (
          <option key={what} value={what}>
            {words}
          </option>
        ))}
      </select>
    </label>
  )
}

function TargetsTable({ targets, predicts }: { targets: Targets; predicts: boolean }) {
  const { within, fitted } = withinCount(targets)
  return (
    <>
      <p data-within={within} data-fitted={fitted}>
        The best design, {placeWord(targets)}, is within tolerance of{' '}
        <strong>
          {within} of {fitted}
        </strong>{' '}
        fitted targets. Its misfit, the root mean square over them, is{' '}
        {formatNumber(targets.fitness)} tolerances.
      </p>
      <Table
        caption="Targets and results of the best design"
        rows={targets.targets}
        rowKey={({ walk, relative_to, quantity }) => `${walk} ${relative_to} ${quantity}`}
        columns={columns(predicts)}
        rowData={({ walk, quantity, use }) => ({
          'data-target': `${walk} ${quantity}`,
          'data-use': use,
        })}
        pageSize={60}
      />
      {predicts && (
        <p class="muted small table-note">
          Left out: result of the best design without that target, among all evaluated designs. This
          requires no simulation.
        </p>
      )}
    </>
  )
}

function columns(predicts: boolean): readonly Column<TargetResult>[] {
  return [
    {
      key: 'walk',
      label: 'Walk',
      header: true,
      value: ({ walk }) => walk,
      cell: ({ walk, relative_to }) => (relative_to ? `${walk} / ${relative_to}` : walk),
    },
    {
      key: 'quantity',
      label: 'Quantity',
      value: (t) => t.quantity,
      cell: (t) => inWords(t.quantity),
    },
    {
      key: 'value',
      label: 'Target',
      numeric: true,
      cell: (t) => quantity(t.value, t.unit),
    },
    {
      key: 'tolerance',
      label: 'Tolerance',
      numeric: true,
      minor: true,
      cell: (t) =>
        t.quantity === 'height_loss' ? `${formatExact(t.tolerance)} m` : percent(t.tolerance, 2),
    },
    {
      key: 'simulated',
      label: 'Simulated',
      numeric: true,
      cell: (t) => quantity(t.simulated, t.unit),
    },
    {
      key: 'off',
      label: 'Deviation, in tolerances',
      numeric: true,
      value: (t) => (t.difference === null ? null : Math.abs(t.difference)),
      cell: (t) => <Off difference={t.difference} />,
    },
    ...(predicts
      ? ([
          {
            key: 'left-out',
            label: 'Left out',
            numeric: true,
            cell: (t) => quantity(t.left_out?.simulated, t.unit),
          },
          {
            key: 'left-out-off',
            label: 'Deviation, left out',
            numeric: true,
            cell: (t) => <Off difference={t.left_out?.difference ?? null} />,
          },
        ] satisfies Column<TargetResult>[])
      : []),
    {
      key: 'use',
      label: 'Use',
      value: ({ use }) => use,
      cell: ({ use }) => (use === 'fit' ? 'fitted' : 'predicted'),
    },
  ]
}

function Off({ difference }: { difference: number | null }) {
  if (difference === null) return <>–</>
  return (
    <span class="off" data-within={isWithin(difference)}>
      {change(difference)}
    </span>
  )
}
