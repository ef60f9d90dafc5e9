/** All designs of a job as numeric columns, decoded from /v1/jobs/{id}/particles. */

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
  /** One value per design; NaN if missing. */
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

/** The given rows with all columns, in the given order. */
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
