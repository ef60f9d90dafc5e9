/** All designs of a job by variable, coloured by fitness, with brushing. */

import { useMemo, useState } from 'preact/hooks'
import { getBytes } from '../../api/client'
import { useResource, useSlowly } from '../../api/resource'
import type { Job } from '../../api/types'
import { ChartCard, LegendEntry } from '../../charts/chart-card'
import { type Brushes, ParallelCoordinates } from '../../charts/parallel/parallel-coordinates'
import {
  bestRows,
  buildModel,
  type ParallelModel,
  selectRows,
} from '../../charts/parallel/parallel-model'
import { Card, EmptyCard, Loaded } from '../../components/card'
import { Empty } from '../../components/feedback'
import { Check } from '../../components/fields/controls'
import { type Column, Table } from '../../components/table/table'
import { formatCount } from '../../format/number'
import { type Place, placeOf, placeWord } from '../../format/place'
import { formatValue, named } from '../../format/value'
import { inWords } from '../../format/words'
import {
  type Codec,
  flag,
  ignore,
  oneOf,
  PAGE_NUMBER,
  useDelayedQuery,
  useQueryValue,
} from '../../router/query-value'
import { DesignLink } from '../columns'
import {
  axesOf,
  brushesOf,
  brushWords,
  columnNamed,
  decodeParticles,
  type ParticleColumn,
  type Particles,
  particlesTable,
} from '../designs/particles'
import { caseWords } from '../facts'
import { BrushFields } from './brush-fields'
import { PairCard } from './pair-card'

const NONE: Brushes = new Map()
const RENEW_MS = 8000

/** Designs loaded at first; more take seconds on slow connections and machines. */
const SAMPLE_SIZE = 3000

/** Best designs listed, and those examined for distinct ones. */
const LISTED = 20
const MOST_BEST = 200

export default function VariablesPanel({ job }: { job: Job }) {
  const iterations = useSlowly(job.iterations, RENEW_MS)
  const [all, setAll] = useQueryValue('designs', oneOf(['sample', 'all'], 'sample'), 'sample')
  const particles = useResource(
    `${job.id} ${iterations} ${all}`,
    (signal) =>
      getBytes('/v1/jobs/{job_id}/particles', {
        path: { job_id: job.id },
        query: {
          objectives: job.kind === 'tuning',
          max_points: all === 'all' ? undefined : SAMPLE_SIZE,
        },
        signal,
      }).then(decodeParticles),
    { keep: true },
  )
  return (
    <Loaded resource={particles} what="the designs">
      {(data) =>
        data.rows === 0 ? (
          <EmptyCard title="No designs yet">
            Designs appear here after the first iteration.
          </EmptyCard>
        ) : (
          <Designs
            job={job}
            particles={data}
            onAll={all === 'all' ? undefined : () => setAll('all')}
          />
        )
      }
    </Loaded>
  )
}

interface DesignsProps {
  job: Job
  particles: Particles
  /** Loads all designs; missing if that was requested. */
  onAll?: () => void
}

function Designs({ job, particles, onAll }: DesignsProps) {
  const words = caseWords(job.kind)
  const [utilities, setUtilities] = useQueryValue('utilities', flag(false), false)
  const [objectives, setObjectives] = useQueryValue('objectives', flag(false), false)
  const [design, setDesign] = useQueryValue('design', DESIGN, null)
  const sources = useMemo(
    () => axesOf(particles, { utility: utilities, objective: objectives }),
    [particles, utilities, objectives],
  )
  const model = useMemo(
    () => buildModel(sources, columnNamed(particles, 'fitness')!.values),
    [sources, particles],
  )
  const [brushes, setBrushes] = useBrushes(model)
  const selected = useMemo(() => selectRows(model, brushes), [model, brushes])
  const marked = useMemo(() => rowOf(particles, design), [particles, design])
  const best = useMemo(() => {
    const rows = distinct(bestRows(model, selected, MOST_BEST), particles).slice(0, LISTED)
    return marked === null || rows.includes(marked) ? rows : [marked, ...rows]
  }, [model, particles, selected, marked])
  const axes = (label: string, checked: boolean, set: (on: boolean) => void) => {
    const change = (on: boolean) => {
      set(on)
      setBrushes(NONE)
    }
    return <Check label={label} checked={checked} onChange={change} />
  }
  const thinned = particles.rows < particles.total
  const count = `${formatCount(selected.length)} of ${formatCount(particles.rows)} designs`
  return (
    <div class="stack" data-selected={selected.length}>
      <ChartCard
        title="Designs by variable"
        note={`Each line is a design. Drag along an axis to select; click it to clear.${
          thinned
            ? ` A sample of ${formatCount(particles.total)} designs; the best is included.`
            : ''
        }`}
        tools={
          <>
            {axes(`${words.measures} by ${words.item}`, utilities, setUtilities)}
            {job.kind === 'tuning' && axes('objectives', objectives, setObjectives)}
            {thinned && onAll && (
              <button type="button" class="compact" onClick={onAll}>
                Load all
              </button>
            )}
            <button
              type="button"
              class="compact"
              disabled={brushes.size === 0}
              onClick={() => setBrushes(NONE)}
            >
              Select all
            </button>
          </>
        }
        legend={
          <>
            <LegendEntry colour="--rank-best" label="best" />
            <LegendEntry colour="--rank-middle" label="middle" />
            <LegendEntry colour="--rank-worst" label="worst, by rank of fitness" />
            <strong aria-live="polite">{count} selected</strong>
          </>
        }
        table={() => <SelectedDesigns job={job} particles={particles} rows={best} />}
        data={() => particlesTable(particles, selected)}
      >
        <ParallelCoordinates
          model={model}
          brushes={brushes}
          onBrush={setBrushes}
          label={`Parallel coordinates of ${count}`}
        />
        <BrushFields model={model} brushes={brushes} onBrush={setBrushes} />
      </ChartCard>
      <PairCard
        model={model}
        selected={selected}
        brushes={brushes}
        onBrush={setBrushes}
        marked={marked}
        onMark={(row) => setDesign(placeIn(particles, row))}
      />
      <Card title="Best selected designs">
        {best.length === 0 ? (
          <Empty title="No design with a fitness is selected">
            <button type="button" onClick={() => setBrushes(NONE)}>
              Select all
            </button>
          </Empty>
        ) : (
          <SelectedDesigns job={job} particles={particles} rows={best} marked={marked} />
        )}
      </Card>
    </div>
  )
}

/** Rows without those whose values, and hence results, equal those of an earlier one. */
function distinct(rows: readonly number[], { columns }: Particles): number[] {
  const compared = columns.filter(({ kind }) => kind !== 'index')
  const seen = new Set<string>()
  return rows.filter((row) => {
    const values = compared.map(({ values }) => values[row]).join()
    return !seen.has(values) && seen.add(values)
  })
}

/** Selection stored in the address; discarded when its axes are hidden. */
function useBrushes(model: ParallelModel): readonly [Brushes, (brushes: Brushes) => void] {
  const write = useDelayedQuery('brush')
  const [brushes, setBrushes] = useState<Brushes>(() => {
    const text = new URLSearchParams(location.search).get('brush')
    const read = brushesOf(model.axes, text)
    if (read.unknown.length > 0) ignore('brush', read.unknown.join())
    return read.brushes
  })
  const change = (next: Brushes) => {
    setBrushes(next)
    write(brushWords(model.axes, next))
  }
  return [brushes, change]
}

const DESIGN: Codec<Place | null> = {
  read: (text) => placeOf(text) ?? undefined,
  write: (place) => place && placeWord(place),
}

/** Row numbers change when designs are added; iteration and particle do not. */
function placeIn(particles: Particles, row: number): Place {
  const [iteration, particle] = ['iteration', 'particle'].map(
    (name) => columnNamed(particles, name)!.values[row],
  )
  return { iteration, particle }
}

function rowOf(particles: Particles, place: Place | null): number | null {
  if (place === null) return null
  const iterations = columnNamed(particles, 'iteration')!.values
  const numbers = columnNamed(particles, 'particle')!.values
  const row = iterations.findIndex(
    (iteration, k) => iteration === place.iteration && numbers[k] === place.particle,
  )
  return row < 0 ? null : row
}

const DIGITS: Readonly<Record<string, number>> = { integer: 1, continuous: 4 }

interface SelectedDesignsProps {
  job: Job
  particles: Particles
  rows: readonly number[]
  marked?: number | null
}

function SelectedDesigns({ job, particles, rows, marked = null }: SelectedDesignsProps) {
  const iteration = columnNamed(particles, 'iteration')!.values
  const particle = columnNamed(particles, 'particle')!.values
  const numbers = particles.columns.filter(({ kind }) => kind !== 'index')
  const paging = useQueryValue('page', PAGE_NUMBER, 0)
  return (
    <Table
      caption="Designs"
      rows={rows}
      rowKey={(row) => `${iteration[row]} ${particle[row]}`}
      paging={paging}
      order={{ column: 'fitness', descending: false }}
      rowData={(row) => ({ 'data-marked': String(row === marked) })}
      columns={[
        {
          key: 'design',
          header: true,
          value: (row) => iteration[row] * 1e5 + particle[row],
          cell: (row) => (
            <DesignLink job={job} iteration={iteration[row]} particle={particle[row]} />
          ),
        },
        ...numbers.map(
          (column): Column<number> => ({
            key: column.name,
            label: labelOf(column, job),
            unit: column.unit,
            numeric: column.kind !== 'categorical',
            value: (row) => (Number.isNaN(column.values[row]) ? null : column.values[row]),
            cell: (row) =>
              formatValue(named(column.values[row], column.choices), DIGITS[column.kind] ?? 5),
          }),
        ),
      ]}
    />
  )
}

function labelOf({ name, kind }: ParticleColumn, job: Job): string {
  if (kind === 'utility') return name.replace(/^utility:/, `${caseWords(job.kind).measure} `)
  return kind === 'objective' ? inWords(name.replace(/^objective:/, '')) : name
}
