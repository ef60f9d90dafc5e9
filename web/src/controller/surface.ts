/** Data of a fuzzy controller's surface: values over error and current. */

import type { components } from '../api/schema'
import type { DataTable } from '../export/csv'
import { withUnit } from '../format/number'

type Schemas = components['schemas']

export type SurfaceView = Schemas['SurfaceView']
export type Universe = Schemas['UniverseView']
export type Output = Schemas['FuzzyOutputView']
export type Rule = Schemas['RuleView']

export type Matrix = readonly (readonly number[])[]

/** A grid point, by index. */
export interface Cell {
  readonly error: number
  readonly current: number
}

/** A matrix over error and current with its meaning. */
export interface Layer {
  readonly key: 'inference' | 'table' | 'difference'
  readonly title: string
  readonly note: string
  readonly values: Matrix
  readonly error: Universe
  readonly current: Universe
  readonly unit: string
  /** Value of full colour, positive or negative. */
  readonly limit: number
}

/** Inference, table, and their difference; the first two share a colour scale. */
export function layersOf(surface: SurfaceView, output: Output): Layer[] {
  const { inference, table, unit } = output
  const axes = { error: inputOf(surface, 'error'), current: inputOf(surface, 'current') }
  const difference = table.map((row, i) => row.map((v, k) => v - inference[i][k]))
  const limit = Math.max(largest(inference), largest(table))
  const layer = (
    key: Layer['key'],
    title: string,
    note: string,
    values: Matrix,
    limit: number,
  ) => ({
    ...axes,
    unit,
    ...{ key, title, note, values, limit },
  })
  return [
    layer('inference', 'Inference', 'Output of the fuzzy rules.', inference, limit),
    layer(
      'table',
      'Quantised table',
      'Output of the microcontroller’s lookup table.',
      table,
      limit,
    ),
    layer(
      'difference',
      'Difference',
      'Table minus inference, on a separate colour scale.',
      difference,
      largest(difference),
    ),
  ]
}

export function inputOf(surface: SurfaceView, name: string): Universe {
  const match = surface.inputs.find((input) => input.name === name)
  if (!match) throw new Error(`the surface has no input ${name}; reload the page`)
  return match
}

export function extent(values: Matrix): readonly [low: number, high: number] {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY]
  for (const row of values) {
    for (const value of row) {
      low = Math.min(low, value)
      high = Math.max(high, value)
    }
  }
  return [low, high]
}

export function cells(values: Matrix): number {
  return values.reduce((sum, row) => sum + row.length, 0)
}

function largest(values: Matrix): number {
  const [low, high] = extent(values)
  return Math.max(Math.abs(low), Math.abs(high))
}

export function firstCell({ error, current }: Layer): Cell {
  return {
    error: Math.floor((3 * error.values.length) / 4),
    current: Math.floor(current.values.length / 4),
  }
}

/** The cell a number of steps away, clamped to the grid. */
export function moved(cell: Cell, errors: number, currents: number, layer: Layer): Cell {
  const within = (index: number, count: number) => Math.min(count - 1, Math.max(0, index))
  return {
    error: within(cell.error + errors, layer.error.values.length),
    current: within(cell.current + currents, layer.current.values.length),
  }
}

export function nearest(values: readonly number[], value: number): number {
  return values.reduce(
    (best, v, k) => (Math.abs(v - value) < Math.abs(values[best] - value) ? k : best),
    0,
  )
}

/** Firing strength of a rule at a cell: the smallest degree of its antecedents times its weight [1]. */
export function strength(rule: Rule, surface: SurfaceView, cell: Cell): number {
  const degrees = Object.entries(rule.if).map(([name, set]) => {
    const input = inputOf(surface, name)
    const membership = input.memberships.find((m) => m.name === set)
    return membership?.degrees[indexOf(input, surface, cell)] ?? 0
  })
  return Math.min(1, ...degrees) * rule.weight
}

/** Index of an input's value at a cell; inputs other than error and current are fixed. */
export function indexOf(input: Universe, surface: SurfaceView, cell: Cell): number {
  if (input.name === 'error') return cell.error
  if (input.name === 'current') return cell.current
  return nearest(input.values, surface.velocity_error ?? 0)
}

export function ruleText(rule: Rule, output: string): string {
  const conditions = Object.entries(rule.if).map(([name, set]) => `${name} is ${set}`)
  return `If ${conditions.join(' and ')}, then ${output} is ${rule.then}`
}

/** All values of a layer, one row per pair of error and current. */
export function layerData({ title, unit, error, current, values }: Layer): DataTable {
  return {
    name: title,
    header: [
      withUnit('error', error.unit),
      withUnit('current', current.unit),
      withUnit(title, unit),
    ],
    rows: error.values.flatMap((e, i) => current.values.map((c, k) => [e, c, values[i][k]])),
  }
}
