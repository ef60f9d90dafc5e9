/** All designs of a job as numeric columns, and selections of them. */

import type { Brushes } from '../../charts/parallel/parallel-coordinates'
import {
  type Axis,
  type AxisSource,
  type Brush,
  buildModel,
  selectRows,
} from '../../charts/parallel/parallel-model'
import { shareOf, valueAt } from '../../charts/scale'
import type { DataTable } from '../../export/csv'
import { withUnit } from '../../format/number'
import { named } from '../../format/value'

export interface ParticleColumn {
  readonly name: string
  readonly unit: string
  /** Bounds of a searched variable; null for other columns. */
  readonly low: number | null
  readonly high: number | null
  readonly kind: string
  /** Names of the choices that the values index; empty unless categorical. */
  readonly choices: readonly string[]
  readonly values: Float32Array
}

export interface Particles {
  readonly rows: number
  /** Number of designs of the job; greater than `rows` if the response was thinned. */
  readonly total: number
  readonly columns: readonly ParticleColumn[]
}

interface Header {
  rows: number
  total: number
  columns: Omit<ParticleColumn, 'values'>[]
}

/** Decode: length of the header (uint32), header (JSON, padded), columns (float32). */
export function decodeParticles(buffer: ArrayBuffer): Particles {
  const length = new DataView(buffer).getUint32(0, true)
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length))
  const header = JSON.parse(text) as Header
  const columns = header.columns.map((column, index) => ({
    ...column,
    values: new Float32Array(buffer, 4 + length + index * header.rows * 4, header.rows),
  }))
  return { rows: header.rows, total: header.total, columns }
}

export function columnNamed(particles: Particles, name: string): ParticleColumn | null {
  return particles.columns.find((column) => column.name === name) ?? null
}

export function particlesTable({ columns }: Particles, rows: Iterable<number>): DataTable {
  return {
    name: 'Designs',
    header: columns.map(({ name, unit }) => withUnit(name, unit)),
    rows: Array.from(rows, (row) =>
      columns.map(({ values, choices }) =>
        Number.isNaN(values[row]) ? null : named(written(values[row]), choices),
      ),
    ),
  }
}

/** Shortest decimal that is the same float32: 0.1, not 0.10000000149011612. */
function written(value: number): number {
  for (let digits = 6; digits < 9; digits++) {
    const short = Number(value.toPrecision(digits))
    if (Math.fround(short) === value) return short
  }
  return value
}

const VARIABLES = new Set(['continuous', 'integer', 'categorical'])

/** Query parameters shared by the tabs: the selection and the highlighted design. */
export const SHARED = ['brush', 'objectives', 'utilities', 'design'] as const

/** Variables, the requested kinds of columns, and finally the fitness. */
export function axesOf(
  { columns }: Particles,
  more: { readonly utility: boolean; readonly objective: boolean },
): readonly AxisSource[] {
  const selected = columns.filter(
    ({ kind }) =>
      VARIABLES.has(kind) ||
      (kind === 'utility' && more.utility) ||
      (kind === 'objective' && more.objective),
  )
  const fitness = columns.filter(({ kind }) => kind === 'fitness')
  return [...selected, ...fitness].map((column) => ({
    name: column.name.replace(/^(utility|objective):/, ''),
    unit: column.unit,
    low: column.low,
    high: column.high,
    logarithmic: !VARIABLES.has(column.kind),
    choices: column.choices,
    values: column.values,
  }))
}

/** Rows selected by a query value written by `brushWords`; null if it selects none or all. */
export function selectedRows(particles: Particles, words: string | null): Uint32Array | null {
  if (!words) return null
  const sources = axesOf(particles, { utility: true, objective: true })
  const model = buildModel(sources, columnNamed(particles, 'fitness')!.values)
  const { brushes } = brushesOf(model.axes, words)
  return brushes.size === 0 ? null : selectRows(model, brushes)
}

/** Write brushes by value, not by position, so that links stay valid when bounds change. */
export function brushWords(axes: readonly Axis[], brushes: Brushes): string | null {
  const words = [...brushes].map(([index, brush]) => {
    const ends = brush.map((place) => Number(valueAt(axes[index], place).toPrecision(6)))
    return [axes[index].name, ...ends].join(':')
  })
  return words.length === 0 ? null : words.join(',')
}

/** Parse brushes; `unknown` collects those of hidden axes and invalid ones. */
export function brushesOf(
  axes: readonly Axis[],
  text: string | null,
): { readonly brushes: Brushes; readonly unknown: readonly string[] } {
  const brushes = new Map<number, Brush>()
  const unknown: string[] = []
  for (const word of (text ?? '').split(',').filter((part) => part !== '')) {
    const parts = word.split(':')
    const [high, low] = [parts.pop(), parts.pop()].map((part) => Number(part || Number.NaN))
    const index = axes.findIndex(({ name }) => name === parts.join(':'))
    const places = index < 0 ? [Number.NaN] : [low, high].map((v) => shareOf(axes[index], v))
    if (places.some(Number.isNaN) || places[0] > places[1]) unknown.push(word)
    else brushes.set(index, places.map((p) => Math.min(1, Math.max(0, p))) as unknown as Brush)
  }
  return { brushes, unknown }
}
