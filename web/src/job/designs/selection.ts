/** Selection of designs shared by the tabs of a job. */

import { type AxisSource, buildModel, selectRows } from '../../charts/parallel/parallel-model'
import { brushesOf } from './brush-words'
import { columnNamed, type Particles } from './particles'

/** Kinds of columns that are variables. */
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
