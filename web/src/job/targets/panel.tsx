/** Targets of a calibration compared with its best design. */

import { useResource } from '../../api/resource'
import type { Job, TargetResult, Targets } from '../../api/types'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Select } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { change, formatExact, formatNumber, NONE, percent, quantity } from '../../format/number'
import { placeWord } from '../../format/place'
import { inWords } from '../../format/words'
import { setQuery, usePlace } from '../../router/navigation'
import { isWithin, loadTargets, metTargets } from '../outcome'

const LEAVE_OUT = [
  ['', 'nothing: compare only'],
  ['target', 'itself'],
  ['walk', 'all targets of its walk'],
] as const

export default function TargetsPanel({ job }: { job: Job }) {
  const word = usePlace().query.get('leave_out')
  const leaveOut = LEAVE_OUT.find(([what]) => what === word)?.[0] ?? ''
  const key = job.best && `${job.id} ${placeWord(job.best)} ${leaveOut}`
  const targets = useResource(key, () => loadTargets(job, leaveOut), { keep: true })
  if (!job.best) {
    return (
      <EmptyCard title="Nothing to compare yet">
        No design has succeeded in every walk yet. The first one that does appears here.
      </EmptyCard>
    )
  }
  return (
    <Card
      title={targets.data ? headline(targets.data) : 'Targets'}
      class="headline-card"
      tools={
        <Select
          label="Predict each target without"
          value={leaveOut}
          options={LEAVE_OUT}
          onChoose={(what) => setQuery({ leave_out: what || null })}
        />
      }
    >
      <Loaded resource={targets} what="the targets">
        {(data) => <TargetsTable targets={data} predicts={leaveOut !== ''} />}
      </Loaded>
    </Card>
  )
}

function headline(targets: Targets): string {
  const [met, fitted] = metTargets(targets)
  return `${met} of ${fitted} targets met`
}

function TargetsTable({ targets, predicts }: { targets: Targets; predicts: boolean }) {
  const [within, fitted] = metTargets(targets)
  return (
    <>
      <p data-within={within} data-fitted={fitted}>
        The best design, {placeWord(targets)}, is{' '}
        {within === fitted ? 'within tolerance of all' : 'outside the tolerance of some'} fitted
        targets. Its misfit, the root mean square over them, is {formatNumber(targets.fitness)}{' '}
        tolerances.
        {within < fitted &&
          ' Check the targets, widen the bounds of the parameters, or add parameters that matter for them.'}
      </p>
      <Table
        caption="Targets and results of the best design"
        rows={targets.targets}
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
  const leftOut: readonly Column<TargetResult>[] = [
    { key: 'left out', numeric: true, cell: (t) => quantity(t.left_out?.simulated, t.unit) },
    {
      key: 'deviation, left out',
      numeric: true,
      cell: (t) => <Deviation value={t.left_out?.difference ?? null} />,
    },
  ]
  return [
    {
      key: 'walk',
      header: true,
      value: ({ walk }) => walk,
      cell: ({ walk, relative_to }) => (relative_to ? `${walk} / ${relative_to}` : walk),
    },
    { key: 'quantity', value: (t) => inWords(t.quantity) },
    { key: 'target', numeric: true, cell: (t) => quantity(t.value, t.unit) },
    {
      key: 'tolerance',
      numeric: true,
      minor: true,
      cell: (t) =>
        t.quantity === 'height_loss' ? `${formatExact(t.tolerance)} m` : percent(t.tolerance, 2),
    },
    { key: 'simulated', numeric: true, cell: (t) => quantity(t.simulated, t.unit) },
    {
      key: 'deviation, in tolerances',
      numeric: true,
      value: (t) => (t.difference === null ? null : Math.abs(t.difference)),
      cell: (t) => <Deviation value={t.difference} />,
    },
    ...(predicts ? leftOut : []),
    { key: 'use', value: ({ use }) => (use === 'fit' ? 'fitted' : 'predicted') },
  ]
}

function Deviation({ value }: { value: number | null }) {
  if (value === null) return <>{NONE}</>
  return (
    <span class="off" data-within={isWithin(value)}>
      {change(value)}
    </span>
  )
}
