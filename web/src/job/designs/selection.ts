/** Designs that were selected by stretches of axes, on whatever part of the job's page. Pure. */

import { type AxisSource, buildModel, selectRows } from '../../charts/parallel/parallel-model'
import { brushesOf } from './brush-words'
import { columnNamed, type Particles } from './particles'

/** Kinds of columns that are variables. */
const VARIABLES = new Set(['continuous', 'integer', 'categorical'])

/** What of an address parts of a job's page have in common: the selection and the marked design. */
export const SHARED = ['brush', 'objectives', 'utilities', 'design'] as const

/** Variables, what else is asked for by its kind, and the fitness last. */
export function axesOf(
  { columns }: Particles,
  more: { readonly utility: boolean; readonly objective: boolean },
): readonly AxisSource[] {
  const wanted = columns.filter(
    ({ kind }) =>
      VARIABLES.has(kind) ||
      (kind === 'utility' && more.utility) ||
      (kind === 'objective' && more.objective),
  )
  const fitness = columns.filter(({ kind }) => kind === 'fitness')
  return [...wanted, ...fitness].map((column) => ({
    name: column.name.replace(/^(utility|objective):/, ''),
    unit: column.unit,
    low: column.low,
    high: column.high,
    logarithmic: !VARIABLES.has(column.kind),
    choices: column.choices,
    values: column.values,
  }))
}

/** Rows that an address selects, as `brushWords` wrote it; null where it selects none or all. */
export function selectedRows(particles: Particles, words: string | null): Uint32Array | null {
  if (!words) return null
  const sources = axesOf(particles, { utility: true, objective: true })
  const model = buildModel(sources, columnNamed(particles, 'fitness')!.values)
  const { brushes } = brushesOf(model.axes, words)
  return brushes.size === 0 ? null : selectRows(model, brushes)
}
